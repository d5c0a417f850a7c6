/* Where the program's own files are: in the checkout that one stands in, else where it is installed. */
#ifndef ASSAY_DATA_DIRS_H
#define ASSAY_DATA_DIRS_H

#include <stddef.h>

/* `checkout` if the current directory is a checkout, else `installed` beside the program ("../share/assay/..."), in path. */
const char *data_dir(char *path, size_t size, const char *checkout, const char *installed);

#endif
