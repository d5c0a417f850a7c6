/* make_mesh box|open RINGS SEGMENTS OUT.dae: a bumpy ball of 2 SEGMENTS (RINGS - 1) triangles, in the
 * assignment's box under its area light, or alone under a directional light. Stands in for meshes of
 * that size that are not ours to ship; a tool of the tests. */
#include "tests/support/mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void effect(FILE *f, const char *id, const char *color)
{
    fprintf(f,
            "<effect id=\"%s-effect\"><profile_COMMON><technique sid=\"common\"><phong><diffuse>"
            "<color>%s 1</color></diffuse></phong></technique></profile_COMMON></effect>\n",
            id, color);
}

static void geometry_open(FILE *f, const char *id, size_t vertices)
{
    fprintf(f,
            "<geometry id=\"%s\"><mesh><source id=\"%s-p\"><float_array id=\"%s-a\" "
            "count=\"%zu\">",
            id, id, id, 3 * vertices);
}

/* Polygons of `corners` corners each, `num` of them: vertex index[i], or i where it is NULL. */
static void geometry_close(FILE *f, const char *id, size_t vertices, const uint32_t *index,
                           size_t num, size_t corners)
{
    fprintf(f,
            "</float_array><technique_common><accessor source=\"#%s-a\" count=\"%zu\" stride=\"3\">"
            "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
            "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
            "<vertices id=\"%s-v\"><input semantic=\"POSITION\" source=\"#%s-p\"/></vertices>"
            "<polylist material=\"m\" count=\"%zu\"><input semantic=\"VERTEX\" source=\"#%s-v\" "
            "offset=\"0\"/><vcount>",
            id, vertices, id, id, num, id);
    for (size_t i = 0; i < num; i++)
        fprintf(f, "%zu ", corners);
    fputs("</vcount><p>", f);
    for (size_t i = 0; i < corners * num; i++)
        fprintf(f, "%zu ", index != NULL ? (size_t)index[i] : i);
    fputs("</p></polylist></mesh></geometry>\n", f);
}

static const struct {
    const char *id, *material, *corners;
} walls[] = {
    {"floor", "white", "-1 -1 0 1 -1 0 1 1 0 -1 1 0"},
    {"ceiling", "white", "-1 -1 1.5 -1 1 1.5 1 1 1.5 1 -1 1.5"},
    {"back", "white", "-1 -1 0 -1 -1 1.5 1 -1 1.5 1 -1 0"},
    {"left", "red", "1 -1 0 1 -1 1.5 1 1 1.5 1 1 0"},
    {"right", "blue", "-1 -1 0 -1 1 0 -1 1 1.5 -1 -1 1.5"},
};
enum { NUM_WALLS = sizeof walls / sizeof walls[0] };

static void node(FILE *f, const char *id, const char *matrix, const char *material)
{
    fprintf(f,
            "<node id=\"%s-node\" name=\"%s\"><matrix>%s</matrix><instance_geometry url=\"#%s\">"
            "<bind_material><technique_common><instance_material symbol=\"m\" target=\"#%s\"/>"
            "</technique_common></bind_material></instance_geometry></node>\n",
            id, id, matrix, id, material);
}

static void write_scene(FILE *f, const struct scene *s, bool box)
{
    static const char *const materials[][2] = {
        {"white", "0.6 0.6 0.6"}, {"red", "0.6 0.2 0.2"}, {"blue", "0.2 0.2 0.6"}};
    fputs("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
          "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
          "<asset><created>2000-01-01T00:00:00</created><modified>2000-01-01T00:00:00</modified>"
          "<up_axis>Z_UP</up_axis></asset>\n<library_lights><light id=\"lamp\">",
          f);
    fputs(
        box ? "<technique_common><point><color>10 10 10</color></point></technique_common><extra>"
              "<technique profile=\"CGL\"><area><color>10 10 10</color></area></technique></extra>"
            : "<technique_common><directional><color>1 1 1</color></directional>"
              "</technique_common>",
        f);
    fputs(
        "</light></library_lights>\n<library_cameras><camera id=\"eye\"><optics><technique_common>"
        "<perspective><xfov>49.13434</xfov><aspect_ratio>1.333333</aspect_ratio><znear>0.1</znear>"
        "<zfar>100</zfar></perspective></technique_common></optics></camera></library_cameras>\n"
        "<library_effects>\n",
        f);
    for (int i = 0; i < 3; i++)
        effect(f, materials[i][0], materials[i][1]);
    fputs("</library_effects><library_materials>\n", f);
    for (int i = 0; i < 3; i++)
        fprintf(f, "<material id=\"%s\"><instance_effect url=\"#%s-effect\"/></material>\n",
                materials[i][0], materials[i][0]);
    fputs("</library_materials><library_geometries>\n", f);
    vec3 *vertex;
    uint32_t *index, vertices = mesh_share(s, &vertex, &index);
    geometry_open(f, "ball", vertices);
    for (uint32_t i = 0; i < vertices; i++)
        fprintf(f, "%.9g %.9g %.9g\n", (double)vertex[i].x, (double)vertex[i].y,
                (double)vertex[i].z);
    geometry_close(f, "ball", vertices, index, s->num_triangles, 3);
    free(vertex);
    free(index);
    for (int i = 0; box && i < NUM_WALLS; i++) {
        geometry_open(f, walls[i].id, 4);
        fputs(walls[i].corners, f);
        geometry_close(f, walls[i].id, 4, NULL, 1, 4);
    }
    fputs("</library_geometries><library_visual_scenes><visual_scene id=\"s\">\n"
          "<node id=\"Lamp\"><matrix>",
          f);
    /* The directional light comes from M (0,0,-1) = (-2, 3, 3), as the assignment reads it. */
    fputs(box ? "0.6 0 0 0 0 0.8 0 0 0 0 1 1.49 0 0 0 1" : "1 0 0 -2 0 1 0 3 0 0 1 4 0 0 0 1", f);
    fputs("</matrix>"
          "<instance_light url=\"#lamp\"/></node>\n"
          "<node id=\"Eye\"><matrix>-1 0 0 0 0 0 1 3 0 1 0 0 0 0 0 1</matrix>"
          "<instance_camera url=\"#eye\"/></node>\n",
          f);
    /* The ball is centred at (0.31, 0.17, -0.23); half its size, it stands in the middle. */
    node(f, "ball", "0.45 0 0 -0.14 0 0.45 0 -0.077 0 0 0.45 0.72 0 0 0 1", "white");
    for (int i = 0; box && i < NUM_WALLS; i++)
        node(f, walls[i].id, "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", walls[i].material);
    fputs("</visual_scene></library_visual_scenes>\n"
          "<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n",
          f);
}

int main(int argc, char **argv)
{
    unsigned rings = argc == 5 ? (unsigned)strtoul(argv[2], NULL, 10) : 0;
    unsigned segments = argc == 5 ? (unsigned)strtoul(argv[3], NULL, 10) : 0;
    if (rings < 2 || rings > 5000 || segments < 3 || segments > 5000 ||
        (strcmp(argv[1], "box") != 0 && strcmp(argv[1], "open") != 0)) {
        fputs("usage: make_mesh box|open RINGS SEGMENTS OUT.dae\n", stderr);
        return 3;
    }
    FILE *f = fopen(argv[4], "w");
    if (f == NULL) {
        perror(argv[4]);
        return 3;
    }
    struct scene s = mesh_ball(rings, segments, 0.5f);
    write_scene(f, &s, strcmp(argv[1], "box") == 0);
    scene_free(&s);
    if (fclose(f) != 0) {
        perror(argv[4]);
        return 3;
    }
    return 0;
}
