#include "data_dirs.h"

#include <unistd.h>

struct data_dirs data_dirs_find(void)
{
    /* That of build/assay, wherever one stands. */
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
