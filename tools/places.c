#include "places.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

void beside_program(char *path, size_t size, const char *name)
{
    char self[3072];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(self, '/');
    if (slash != NULL)
        *slash = '\0';
    snprintf(path, size, "%s/%s", slash != NULL ? self : ".", name);
}

const char *find_dir(char *path, size_t size, const char *checkout, const char *installed)
{
    if (access("reference/scenes", R_OK) == 0)
        return checkout;
    beside_program(path, size, installed);
    return path;
}
