#include "render_id.h"

#include "renderer/base/sha256.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Adds a setting that newer versions have. It is written only if it differs from the default, so
 * that images made before it existed have the same text. */
__attribute__((format(printf, 2, 3))) static void add_setting(struct render_id *id,
                                                              const char *format, ...)
{
    size_t n = strlen(id->settings);
    va_list args;
    va_start(args, format);
    vsnprintf(id->settings + n, sizeof id->settings - n, format, args);
    va_end(args);
}

/* One hash of all texture files and of all other documents that the scene was read from; "" if there are none. */
static bool hash_files(const struct scene *s, char hex[65], struct err *e)
{
    char text[2 * 65];
    hex[0] = '\0';
    for (uint32_t i = 0; i < s->num_images + s->num_documents; i++) {
        char one[65];
        const char *file = i < s->num_images ? image_get_attr(&s->images[i], SCENE_IMAGE_FILE)
                                             : s->documents[i - s->num_images];
        if (!sha256_file(file, one, e))
            return false;
        snprintf(text, sizeof text, "%s%s", hex, one);
        sha256_text(text, hex);
    }
    return true;
}

bool render_id_make(const struct options *o, const struct scene *s, struct render_id *id,
                    struct err *e)
{
    char camera[65] = "none", environment[65] = "none", images[65];
    *id = (struct render_id){.first_sample = (uint32_t)o->first};
    if (o->camera_name != NULL)
        snprintf(camera, sizeof camera, "%s", o->camera_name);
    if (!sha256_file(o->scene, id->scene, e) ||
        (o->camera_file != NULL && !sha256_file(o->camera_file, camera, e)) ||
        (o->environment_file != NULL && !sha256_file(o->environment_file, environment, e)) ||
        !hash_files(s, images, e))
        return false;
    /* The dialect by number: 0 stands for auto, which the scene file decides. */
    snprintf(id->settings, sizeof id->settings,
             "integrator %s; direct %s; max-bounces %d; first-bounce %d; light-samples %d; "
             "roulette %d %.17g; accel %s; dialect %d; lens-radius %.17g; focal-distance %.17g; "
             "camera %s; environment %s; fresnel %d; sampler %s",
             integrator_kind_names[o->kind], direct_kind_names[o->direct], o->max_bounces,
             o->first_bounce, o->light_samples, (int)o->roulette, o->survival,
             bvh_kind_names[o->accel], o->dialect, o->lens_radius, o->focal_distance, camera,
             environment, o->fresnel, sampler_kind_names[o->sampler]);
    if (o->guiding)
        add_setting(id, "; guiding on");
    if (o->starter != 0 || o->frame != FRAME_CROP)
        add_setting(id, "; starter %u; frame %d", o->starter, o->frame);
    if (images[0] != '\0')
        add_setting(id, "; images %.32s", images);
    if (o->filter.radius > 0) {
        char filter[PIXEL_FILTER_TEXT];
        pixel_filter_print(&o->filter, filter);
        add_setting(id, "; filter %s", filter);
    }
    if (o->adaptive_batch > 0)
        snprintf(id->adaptive, sizeof id->adaptive, "rule %d %.17g", o->adaptive_batch,
                 o->adaptive_tolerance);
    else if (o->pilot_tolerance >= 0)
        snprintf(id->adaptive, sizeof id->adaptive, "pilot %d %.17g most %d", o->pilot,
                 o->pilot_tolerance, o->spp);
    else
        snprintf(id->adaptive, sizeof id->adaptive, "off");
    snprintf(id->seed, sizeof id->seed, "%llu", (unsigned long long)o->seed);
    render_id_cell(o->cell, o->width, o->height, id->cell);
    return true;
}

void render_id_cell(const int cell[4], int width, int height, char text[64])
{
    snprintf(text, 64, "%d %d %d %d of %d %d", cell[0], cell[1], cell[2], cell[3], width, height);
}

bool render_id_parse_cell(const char *text, int c[6])
{
    int end = 0;
    if (strlen(text) > 60 ||
        sscanf(text, "%5d %5d %5d %5d of %5d %5d%n", &c[0], &c[1], &c[2], &c[3], &c[4], &c[5],
               &end) != 6 ||
        text[end] != '\0')
        return false;
    return c[0] >= 0 && c[1] >= 0 && c[2] > 0 && c[3] > 0 && c[0] + c[2] <= c[4] &&
           c[1] + c[3] <= c[5];
}
