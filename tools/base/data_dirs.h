/* Where the program's own files are: in the current directory if that is a checkout, else in the
 * checkout that the program (build/assay) is in, else where it is installed. */
#ifndef ASSAY_DATA_DIRS_H
#define ASSAY_DATA_DIRS_H

#include "renderer/base/fs.h"

struct data_dirs {
    struct path suite, golden, catalogue; /* scenes, stored references, effects of bugs */
    struct path share;                    /* scripts for other programs, and descriptions of them */
    struct path pathtracer;               /* the program beside this one */
};
struct data_dirs data_dirs_find(void);
/* The same for the suite in suite_dir and, if that is a suite of the user's own (suite_own.h), with its golden/. NULL:
 * the current directory if that is such a suite, else as data_dirs_find(). */
struct data_dirs data_dirs_of_suite(const char *suite_dir);

#endif
