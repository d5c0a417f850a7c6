#include "data_dirs.h"

#include "renderer/base/fs.h"

#include <unistd.h>

const char *data_dir(char *path, size_t size, const char *checkout, const char *installed)
{
    if (access("reference/scenes", R_OK) == 0)
        return checkout;
    fs_beside_program(path, size, installed);
    return path;
}
