#include "truth.h"

bool truth_check_triple(const char *name, const double v[3], double hi, struct err *e)
{
    for (int c = 0; c < 3; c++)
        if (!(v[c] >= 0 && v[c] <= hi))
            return err_set(e, "%s[%d] is %g, not in [0, %g]", name, c, v[c], hi);
    return true;
}

bool truth_check_depth(const struct suite_scene *scene, struct err *e)
{
    return scene->depth >= 1 ||
           err_set(e, "depth is %d, but the form needs direct light (1 or more)", scene->depth);
}
