#include "data_dirs.h"

#include <unistd.h>

struct data_dirs data_dirs_find(void)
{
    bool checkout = access("reference/scenes", R_OK) == 0;
    struct path share = checkout ? fs_path("reference") : fs_beside_program("../share/assay"),
                golden = checkout ? fs_path("golden") : fs_path("%s/golden", share.s);
    return (struct data_dirs){.suite = fs_path("%s/scenes", share.s),
                              .golden = golden,
                              .catalogue = fs_path("%s/diagnose", golden.s),
                              .share = share,
                              .pathtracer = fs_beside_program("pathtracer")};
}
