#include "camera.h"

#include "renderer/base/fs.h"

#include "camera_simd.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The assignment fits its angle of view to an image of this shape, then crops or extends it. */
enum { CGL_WIDTH = 800, CGL_HEIGHT = 600 };

static void place_cgl(struct camera *c, const struct scene *s)
{
    vec3 target = scale(add(s->frame_min, s->frame_max), 0.5f);
    float distance = 1.5f * length(sub(s->frame_max, s->frame_min));
    c->backward = normalize(s->camera.backward);
    c->eye = mad(target, distance, c->backward);
    vec3 up = v3(0, 1, 0);
    if (fabsf(c->backward.y) > 0.99999f)
        up = v3(0, 0, c->backward.y > 0 ? -1 : 1);
    c->right = normalize(cross(up, c->backward));
    c->up = cross(c->backward, c->right);
}

static void angles_cgl(struct camera *c, const struct scene_camera *f)
{
    float tan_h = tanf(f->hfov / 2), tan_v = tanf(f->vfov / 2);
    const float shape = (float)CGL_WIDTH / CGL_HEIGHT;
    if (tan_h / tan_v >= shape)
        tan_v = tan_h / shape;
    float screen_distance = CGL_HEIGHT / (2 * tan_v);
    c->tan_h = (float)c->width / (2 * screen_distance);
    c->tan_v = (float)c->height / (2 * screen_distance);
}

void camera_show_whole(struct camera *c)
{
    float shrunk = fminf((float)c->width / CGL_WIDTH, (float)c->height / CGL_HEIGHT);
    c->tan_h /= shrunk;
    c->tan_v /= shrunk;
}

bool camera_init(struct camera *c, const struct scene *s, int width, int height, struct err *e)
{
    const struct scene_camera *f = &s->camera;
    *c = (struct camera){.width = width, .height = height, .near = f->near, .far = f->far};
    if (s->dialect == DIALECT_CGL) {
        /* For a scene without a camera the loader has set the assignment's default one. */
        place_cgl(c, s);
        angles_cgl(c, f);
        return true;
    }
    if (!f->present)
        return err_set(e, "the scene has no camera");
    c->eye = f->eye;
    c->right = f->right;
    c->up = f->up;
    c->backward = f->backward;
    float shape = (float)height / (float)width;
    if (f->hfov > 0) {
        c->tan_h = tanf(f->hfov / 2);
        c->tan_v = c->tan_h * shape;
    } else {
        c->tan_v = tanf(f->vfov / 2);
        c->tan_h = c->tan_v / shape;
    }
    c->is_orthographic = f->xmag > 0 || f->ymag > 0;
    if (c->is_orthographic) {
        c->tan_h = f->xmag > 0 ? f->xmag : f->ymag / shape;
        c->tan_v = c->tan_h * shape;
    }
    return true;
}

bool camera_read_file(struct camera *c, const char *path, struct err *e)
{
    FILE *f = fs_open(path);
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    /* hFov vFov aspect near far / pos target / phi theta r minR maxR / c2w by rows / screenW
     * screenH screenDist / focalDistance lensRadius; angles in degrees. */
    enum { NUMBERS = 5 + 6 + 5 + 9 + 3 + 2 };
    double x[NUMBERS];
    char word[64];
    int n = 0;
    bool ok = true;
    while (ok && fscanf(f, "%63s", word) == 1) {
        char *end;
        double v = strtod(word, &end);
        if (*end != '\0' || !isfinite(v))
            ok = err_set(e, "%s: '%s' is not a number", path, word);
        else if (n == NUMBERS)
            ok = err_set(e, "%s: more than the %d numbers of a camera file", path, NUMBERS);
        else
            x[n++] = v;
    }
    fclose(f);
    if (!ok)
        return false;
    if (n != NUMBERS)
        return err_set(e, "%s: %d numbers, a camera file has %d", path, n, NUMBERS);
    const double narrow = 1e-3, wide = 179.9;
    if (!(x[0] >= narrow && x[0] <= wide && x[1] >= narrow && x[1] <= wide && x[3] >= 0 &&
          x[4] > x[3]))
        return err_set(e, "%s: angles of view or clip distances out of range", path);
    for (int k = 5; k < 8; k++)
        if (fabs(x[k]) > FARTHEST)
            return err_set(e, "%s: position beyond %g", path, FARTHEST);
    if (!(x[28] >= 1e-6 && x[28] <= 1e9 && x[29] >= 0 && x[29] <= 1e6))
        return err_set(e, "%s: focal distance or lens radius out of range", path);
    const double *m = x + 16;
    vec3 axes[3];
    for (int k = 0; k < 3; k++) {
        axes[k] = v3((float)m[k], (float)m[3 + k], (float)m[6 + k]);
        if (fabsf(length(axes[k]) - 1) > 1e-3f)
            return err_set(e, "%s: column %d of the camera's matrix is not of unit length", path,
                           k + 1);
    }
    if (fabsf(dot(axes[0], axes[1])) > 1e-3f ||
        length(sub(cross(axes[0], axes[1]), axes[2])) > 2e-3f)
        return err_set(e, "%s: the camera's matrix is not a rotation", path);
    const double degree = M_PI / 180;
    c->is_orthographic = false;
    c->right = normalize(axes[0]);
    c->up = normalize(axes[1]);
    c->backward = normalize(axes[2]);
    c->eye = v3((float)x[5], (float)x[6], (float)x[7]);
    c->tan_h = (float)tan(x[0] * degree / 2);
    c->tan_v = (float)tan(x[1] * degree / 2);
    c->near = (float)x[3];
    c->far = (float)x[4];
    c->focal_distance = (float)x[28];
    c->lens_radius = (float)x[29];
    return true;
}

ray camera_ray(const struct camera *c, float x, float y, float u, float v)
{
    ray r = {.tmin = c->near, .tmax = c->far};
    camera_rays(c, x, y, u, v, &r.o, &r.d);
    return r;
}
