/* make_sky SCENE.json WIDTH HEIGHT OUT.exr: writes the environment map of a scene whose closed form
 * is a sky gradient, from its numbers. reference/scenes/35_sky_gradient.exr was made so, with 64
 * 32. */
#include "reference/truth/truth_sky.h"
#include "renderer/image/image.h"

#include <stdio.h>
#include <stdlib.h>

static bool make(const char *scene, int width, int height, const char *out, struct err *e)
{
    static const char *const NAMES[] = {"R", "G", "B"};
    struct truth_gradient sky;
    struct image im = {0};
    json_error_t why;
    json_t *json = json_load_file(scene, 0, &why), *values;
    if (json == NULL ||
        json_unpack_ex(json, &why, 0, "{s:{s:{s:o}}}", "references", "truth", "values", &values)) {
        json_decref(json);
        return err_set(e, "%s: %s", scene, why.text);
    }
    bool ok = truth_gradient_read(values, &sky, e) && image_alloc(&im, width, height, 3, NAMES, e);
    for (int i = 0; ok && i < width * height; i++)
        for (int c = 0; c < 3; c++)
            im.data[3 * i + c] =
                (float)truth_gradient_texel(&sky, c, width, height, i % width, i / width);
    ok = ok && image_write_exr(out, &im, e);
    image_free(&im);
    json_decref(json);
    return ok;
}

int main(int argc, char **argv)
{
    struct err e = {""};
    int width = argc == 5 ? atoi(argv[2]) : 0, height = argc == 5 ? atoi(argv[3]) : 0;
    if (width < 4 || height < 2 || width > 4096 || height > 4096) {
        fprintf(stderr, "usage: make_sky SCENE.json WIDTH HEIGHT OUT.exr\n");
        return 3;
    }
    if (!make(argv[1], width, height, argv[4], &e)) {
        fprintf(stderr, "make_sky: %s\n", e.msg);
        return 3;
    }
    return 0;
}
