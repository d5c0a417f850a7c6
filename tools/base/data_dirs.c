#include "data_dirs.h"

#include "reference/suite/suite_own.h"

#include <unistd.h>

struct data_dirs data_dirs_find(void)
{
    /* In the checkout of build/assay, whatever the current directory. */
    const struct path beside = fs_beside_program("../reference");
    bool here = access("reference/scenes", R_OK) == 0,
         checkout = here || access(fs_path("%s/scenes", beside.s).s, R_OK) == 0;
    struct path share = here       ? fs_path("reference")
                        : checkout ? beside
                                   : fs_beside_program("../share/assay"),
                golden = here       ? fs_path("golden")
                         : checkout ? fs_beside_program("../golden")
                                    : fs_path("%s/golden", share.s);
    return (struct data_dirs){.suite = fs_path("%s/scenes", share.s),
                              .golden = golden,
                              .catalogue = fs_path("%s/diagnose", golden.s),
                              .share = share,
                              .pathtracer = fs_beside_program("pathtracer")};
}

struct data_dirs data_dirs_of_suite(const char *suite_dir)
{
    struct data_dirs at = data_dirs_find();
    if (suite_dir == NULL && !suite_own_is("."))
        return at;
    at.suite = fs_path("%s", suite_dir != NULL ? suite_dir : ".");
    if (suite_dir == NULL)
        at.golden = fs_path("golden");
    else if (suite_own_is(suite_dir))
        at.golden = fs_path("%s/golden", suite_dir);
    return at;
}
