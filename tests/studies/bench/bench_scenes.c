#include "bench_scenes.h"

#include "renderer/collada/collada.h"
#include "tests/support/mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name, *course; /* directory below ASSAY_CS184; NULL: not the course's */
    uint32_t ball, terrain;    /* triangles; 0: a file */
} table[BENCH_NUM_SCENES] = {
    {"18_mirror_box", NULL, 0, 0},
    {"41_cornell", NULL, 0, 0},
    {"CBspheres_lambertian", "sky", 0, 0},
    {"CBspheres", "sky", 0, 0},
    {"44_mesh", NULL, 0, 0},
    {"CBbunny", "sky", 0, 0},
    {"CBgems", "sky", 0, 0},
    {"cow", "meshedit", 0, 0},
    {"maxplanck", "meshedit", 0, 0},
    {"banana", "keenan", 0, 0},
    {"ball 10^3", NULL, 1000, 0},
    {"ball 10^4", NULL, 10000, 0},
    {"ball 10^5", NULL, 100000, 0},
    {"ball 10^6", NULL, 1000000, 0},
    {"terrain 10^4", NULL, 0, 10000},
    {"terrain 10^6", NULL, 0, 1000000},
};

const char *bench_scene_name(int i)
{
    return table[i].name;
}

/* A bumpy ball of about n triangles in a box without a front. */
static struct scene ball_in_box(uint32_t n)
{
    static const float corner[8][3] = {{-1, -0.75f, -1}, {1, -0.75f, -1}, {1, 0.75f, -1},
                                       {-1, 0.75f, -1},  {-1, -0.75f, 1}, {1, -0.75f, 1},
                                       {1, 0.75f, 1},    {-1, 0.75f, 1}};
    static const int wall[5][4] = {
        {0, 1, 2, 3}, {0, 4, 5, 1}, {3, 2, 6, 7}, {0, 3, 7, 4}, {1, 5, 6, 2}};
    uint32_t rings = (uint32_t)sqrtf((float)n / 2);
    struct scene s = mesh_ball(rings, rings, 0.5f);
    uint32_t first = s.num_triangles;
    s.position = realloc(s.position, 3 * (size_t)(first + 10) * sizeof *s.position);
    if (s.position == NULL)
        abort();
    for (size_t i = 0; i < 3 * (size_t)first; i++)
        s.position[i] = scale(sub(s.position[i], v3(0.31f, 0.17f, -0.23f)), 0.45f);
    for (uint32_t i = 0; i < 5; i++)
        for (uint32_t k = 0; k < 6; k++) {
            const float *c = corner[wall[i][k < 3 ? k : k == 3 ? 0 : k - 2]];
            s.position[3 * first + 6 * i + k] = v3(c[0], c[1], c[2]);
        }
    s.num_triangles += 10;
    return s;
}

/* The file's path in out->path; false if it is the course's and not here. */
static bool find_file(int i, struct bench_scene *out)
{
    const char *root = getenv("ASSAY_CS184");
    if (table[i].course == NULL) {
        snprintf(out->path, sizeof out->path, "reference/scenes/%s.dae", out->name);
        return true;
    }
    snprintf(out->path, sizeof out->path, "%s/%s/%s.dae",
             root != NULL ? root : "../shared/scenes/cs184", table[i].course, out->name);
    FILE *f = fopen(out->path, "rb");
    if (f == NULL) {
        printf("SKIPPED: no %s (set ASSAY_CS184)\n", out->path);
        return false;
    }
    fclose(f);
    return true;
}

bool bench_scene_load(const char *name, struct bench_scene *out)
{
    int i = 0;
    while (strcmp(table[i].name, name) != 0)
        if (++i == BENCH_NUM_SCENES) {
            fprintf(stderr, "bench: no scene '%s'\n", name);
            exit(3);
        }
    *out = (struct bench_scene){.framed = false};
    snprintf(out->name, sizeof out->name, "%s", name);
    if (table[i].ball > 0 || table[i].terrain > 0) {
        uint32_t side = (uint32_t)sqrtf((float)(table[i].ball + table[i].terrain) / 2);
        out->scene = table[i].ball > 0 ? ball_in_box(table[i].ball) : mesh_terrain(side, 1);
        return true;
    }
    if (!find_file(i, out))
        return false;
    struct err e = {0};
    if (!collada_load(out->path, table[i].course != NULL ? DIALECT_CGL : DIALECT_AUTO, &out->scene,
                      &e)) {
        fprintf(stderr, "bench: %s\n", e.msg);
        exit(3);
    }
    out->framed = true;
    return true;
}

void bench_scene_bounds(const struct scene *s, vec3 *lo, vec3 *hi)
{
    *lo = v3(INFINITY, INFINITY, INFINITY);
    *hi = neg(*lo);
    for (size_t i = 0; i < 3 * (size_t)s->num_triangles; i++) {
        *lo = vmin(*lo, s->position[i]);
        *hi = vmax(*hi, s->position[i]);
    }
    for (uint32_t i = 0; i < s->num_spheres; i++) {
        vec3 r = v3(s->spheres[i].radius, s->spheres[i].radius, s->spheres[i].radius);
        *lo = vmin(*lo, sub(s->spheres[i].centre, r));
        *hi = vmax(*hi, add(s->spheres[i].centre, r));
    }
}
