#include "heatmap.h"

#include "renderer/image/tone.h"

#include <stdlib.h>

/* A helix in Oklab: lightness rises linearly while (a, b) goes once around a circle through the grey axis, whose
 * diameter is the largest chroma, so the speed is constant. The constants keep it inside sRGB. */
void heatmap_colour(double t, uint8_t rgb8[3])
{
    const double chroma = 0.2, hue = 288 * M_PI / 180;
    double lightness = 0.2 + 0.77 * t, c = chroma * sin(M_PI * t);
    double a = c * cos(hue + M_PI * t), b = c * sin(hue + M_PI * t);
    /* Oklab to linear sRGB [Ottosson20]. */
    double l = pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
    double m = pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
    double s = pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
    rgb8[0] = tone_map(TONE_SRGB, 4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s);
    rgb8[1] = tone_map(TONE_SRGB, -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s);
    rgb8[2] = tone_map(TONE_SRGB, -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s);
}

bool heatmap_write(const char *path, const struct bvh *bvh, const struct camera *c, int x, int y,
                   int width, int height, uint64_t *most, struct err *e)
{
    bool ok = false;
    size_t pixels = (size_t)width * (size_t)height;
    uint64_t *visits = calloc(pixels, sizeof *visits);
    uint8_t *bytes = malloc(3 * pixels);
    struct rays *rays = calloc(1, sizeof *rays);
    struct hits *hits = calloc(1, sizeof *hits);
    *most = 0;
    if (visits == NULL || bytes == NULL || rays == NULL || hits == NULL) {
        err_set(e, "%s: out of memory", path);
        goto done;
    }
    struct camera pinhole = *c;
    pinhole.lens_radius = 0;
    for (size_t p = 0; p < pixels; p++) {
        float px = (float)(x + (int)(p % (size_t)width)) + 0.5f;
        float py = (float)(y + (int)(p / (size_t)width)) + 0.5f;
        const uint16_t lane = 0;
        struct bvh_stats stats = {0};
        rays_set(rays, 0, camera_ray(&pinhole, px, py, 0, 0));
        bvh_closest(bvh, rays, &lane, 1, hits, &stats);
        visits[p] = stats.box_tests;
        *most = visits[p] > *most ? visits[p] : *most;
    }
    for (size_t p = 0; p < pixels; p++)
        heatmap_colour(*most > 0 ? (double)visits[p] / (double)*most : 0, bytes + 3 * p);
    ok = image_write_png(path, width, height, bytes, e);
done:
    free(visits);
    free(bytes);
    free(rays);
    free(hits);
    return ok;
}
