/* make_suite_files DIR: writes 44_mesh.dae, 46_sky.exr and 96_sky_turned.exr of the suite into DIR. */
#include "tests/support/suite_files.h"

static bool write_sky(const char *dir, const char *name, int turn, struct err *e)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    struct image sky;
    if (!suite_sky(turn, &sky, e))
        return false;
    bool ok = image_write_exr(path, &sky, e);
    image_free(&sky);
    return ok;
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        fputs("usage: make_suite_files DIR\n", stderr);
        return 3;
    }
    char path[4096];
    snprintf(path, sizeof path, "%s/44_mesh.dae", argv[1]);
    FILE *f = fopen(path, "w");
    if (f == NULL) {
        perror(path);
        return 3;
    }
    suite_write_mesh(f);
    if (fclose(f) != 0) {
        perror(path);
        return 3;
    }
    struct err e;
    if (!write_sky(argv[1], "46_sky.exr", 0, &e) ||
        !write_sky(argv[1], "96_sky_turned.exr", SKY_TURN, &e)) {
        fprintf(stderr, "%s\n", e.msg);
        return 3;
    }
    return 0;
}
