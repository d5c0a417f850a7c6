/* One POV-Ray image: what reference/povray/povray_replicate_parts.h calls indirect_i, which by itself has all the light,
 * with lamps by a small Gauss rule. The recipe of the suite adds images to it with finer lamps, which all
 * replicates share. */
#include "bench_povray.h"

#include "reference/povray/povray_replicate_parts.h"
#include "reference/base/process.h"
#include "renderer/base/fs.h"
#include "renderer/image/image.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

enum { LAMP_CELLS = 4 };

/* image += the image, averaged over grid x grid sub-pixels. */
static bool add_image(const char *path, const struct povray_image *p, const struct camera *c,
                      float *image, struct err *e)
{
    struct image im;
    if (!image_read_exr(path, &im, NULL, e))
        return false;
    const int at[3] = {image_channel(&im, "R"), image_channel(&im, "G"), image_channel(&im, "B")};
    bool ok = im.width == p->grid * c->width && im.height == p->grid * c->height && at[0] >= 0 &&
              at[1] >= 0 && at[2] >= 0;
    if (!ok)
        err_set(e, "%s: not the picture that was asked for", path);
    float scale = 1 / (float)(p->variant.scale * p->grid * p->grid);
    for (int y = 0; ok && y < im.height; y++)
        for (int x = 0; x < im.width; x++)
            for (int k = 0; k < 3; k++)
                image[3 * ((size_t)(y / p->grid) * (size_t)c->width + (size_t)(x / p->grid)) +
                      (size_t)k] +=
                    scale *
                    im.data[((size_t)y * (size_t)im.width + (size_t)x) * (size_t)im.channels +
                            (size_t)at[k]];
    image_free(&im);
    return ok;
}

bool bench_povray(const struct bench_view *v, int grid, int i, uint32_t seed, const char *work_dir,
                  float *image, struct err *e)
{
    const struct camera *c = &v->camera;
    char dir[4096], path[4200], log[4200], size[3][16];
    struct povray_passes plan;
    memset(image, 0, 3 * (size_t)c->width * (size_t)c->height * sizeof *image);
    snprintf(dir, sizeof dir, "%s/povray", work_dir);
    snprintf(log, sizeof log, "%s/log", dir);
    if (!povray_passes(&v->scene, c, v->depth, &plan, e) || !fs_make_dirs(dir, e))
        return false;
    for (int pass = 0; pass < plan.num_passes; pass++) {
        struct povray_image p =
            povray_replicate(&plan, c->width, c->height, grid, i, seed, pass, true);
        p.variant.rule = POVRAY_GAUSS;
        p.variant.lamp_cells = LAMP_CELLS;
        snprintf(path, sizeof path, "%s/scene.pov", dir);
        FILE *f = fopen(path, "w");
        if (f == NULL)
            return err_set(e, "%s: cannot write: %s", path, strerror(errno));
        bool ok = export_povray(&v->scene, c, v->depth, &p.variant, f, e);
        if (fclose(f) != 0 && ok)
            ok = err_set(e, "%s: cannot write: %s", path, strerror(errno));
        if (!ok)
            return false;
        snprintf(size[0], sizeof size[0], "+W%d", p.grid * c->width);
        snprintf(size[1], sizeof size[1], "+H%d", p.grid * c->height);
        snprintf(size[2], sizeof size[2], "+BS%d", p.block);
        const char *const argv[] = {"povray", "+Iscene.pov", "+Oscene.exr", "+FE", size[0],
                                    size[1],  size[2],       "+WT1",        "-A",  "-C",
                                    "-D",     "-P",          "-V",          "+Q9", "File_Gamma=1.0",
                                    NULL};
        const struct process run = {.argv = argv, .cwd = dir, .log = log, .timeout_s = 3600};
        snprintf(path, sizeof path, "%s/scene.exr", dir);
        if (!process_run(&run, NULL, e) || !add_image(path, &p, c, image, e))
            return false;
    }
    return true;
}
