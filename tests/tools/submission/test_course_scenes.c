/* Every scene of tools/rubrics/ against the rules of the course's starter code (course_scene.h). Each rule has
 * a control: a scene that breaks it, made from a shipped one by replacing some of its text. */

#include "course_scene.h"
#include "renderer/base/fs.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <dirent.h>

static char *read_scene(const char *name)
{
    return test_read(fs_path("tools/rubrics/%s", name).s);
}

/* `text` with what lies between two of its places replaced. */
static char *replaced(const char *text, const char *from, const char *to, const char *by)
{
    size_t size = strlen(text) + strlen(by) + 1;
    char *out = malloc(size);
    assert_non_null(out);
    snprintf(out, size, "%.*s%s%s", (int)(from - text), text, by, to);
    return out;
}

TEST(the_shipped_scenes_keep_the_rules)
{
    DIR *dir = opendir("tools/rubrics");
    assert_non_null(dir);
    int num = 0;
    for (struct dirent *d; (d = readdir(dir)) != NULL;) {
        size_t n = strlen(d->d_name);
        if (n < 4 || strcmp(d->d_name + n - 4, ".dae") != 0)
            continue;
        OWN_TEXT text = read_scene(d->d_name);
        const char *told = course_scene_breach(text, strcmp(d->d_name, "sky.dae") == 0);
        /* The one that is there to be hard to split. */
        bool ok = strcmp(d->d_name, "stack.dae") == 0 ? strstr(told, "no plane") != NULL
                                                      : told[0] == '\0';
        if (!ok)
            fail_msg("%s: %s", d->d_name, told);
        num++;
    }
    closedir(dir);
    assert_true(num >= 22);
}

TEST(each_broken_rule_is_seen)
{
    static const struct {
        const char *scene, *from, *to, *rule;
    } cases[] = {
        {"matt.dae", "Z_UP", "Y_UPS", "Z_UP"},
        {"matt.dae", "url=\"#scene\"", "url=\"#scenes\"", "a visual scene"},
        {"matt.dae", "<node id=\"near-node\" name=\"near\">", "<node id=\"near-node\">",
         "a node has"},
        {"matt.dae", "<matrix>1 0 0 -0.42", "<translate>0 0 0</translate><matrix>1 0 0 -0.42",
         "one matrix"},
        {"matt.dae", "<matrix>1 0 0 -0.42", "<matrix>0 0 -0.42", "one matrix"},
        {"matt.dae", "<instance_geometry url=\"#near-mesh\">", "<instance_geometry url=\"#none\">",
         "one thing"},
        {"matt.dae", "<instance_light url=\"#lamp\"/>", "<node id=\"a\" name=\"a\"/>", "one thing"},
        {"matt.dae", "<geometry id=\"floor-mesh\" name=\"floor\">", "<geometry id=\"floor-mesh\">",
         "a name"},
        {"matt.dae", "<light id=\"lamp\" name=\"lamp\">", "<light id=\"lamp\">", "a name"},
        {"matt.dae", "<camera id=\"eye\" name=\"eye\">", "<camera id=\"eye\">", "a name"},
        {"matt.dae", "<aspect_ratio>1.333333</aspect_ratio>", "", "aspect_ratio"},
        {"matt.dae", "<instance_camera url=\"#eye\"/>", "<instance_light url=\"#lamp\"/>",
         "one camera"},
        {"matt.dae", " profile=\"CGL\"", "", "without a profile"},
        {"matt.dae", "<area><color>2.5 2.5 2.5</color></area>", "<spot><color>1 1 1</color></spot>",
         "a light is"},
        {"matt.dae", "<area><color>2.5 2.5 2.5</color></area>",
         "<point><color>1 1 1</color></point>", "attenuations"},
        {"matt.dae",
         "<extra><technique profile=\"CGL\"><area><color>2.5 2.5 2.5</color></area></technique></extra>",
         "", "an extra of CGL"},
        {"lights.dae", " -2.598076 ", " 2.598076 ", "its own axis"},
        {"matt.dae", "<material id=\"matt\" name=\"matt\">", "<material id=\"matt\">",
         "a material has"},
        {"matt.dae", "target=\"#matt\"", "target=\"#mat\"", "a material has"},
        {"matt.dae", "<technique sid=\"common\">", "<technique>", "without a sid"},
        {"matt.dae", "<emission><radiance>2.5 2.5 2.5</radiance></emission>", "<lambertian/>",
         "unknown kind"},
        {"specular.dae", "<roughness>0</roughness>", "", "lacks one"},
        {"matt.dae", "<sphere><radius>0.3</radius></sphere>", "<sphere/>", "with a radius"},
        {"matt.dae", "<matrix>1 0 0 -0.42", "<matrix>2 0 0 -0.42", "not scaled"},
        {"matt.dae", "<source id=\"floor-p\">", "<source>", "a source has"},
        {"matt.dae", "count=\"12\"", "count=\"15\"", "a source has"},
        {"matt.dae", "<vertices id=\"floor-v\">", "<vertices>", "vertices with an id"},
        {"matt.dae", "</polylist>", "</polylist><triangles/>", "one polylist"},
        {"matt.dae", "semantic=\"NORMAL\"", "semantic=\"COLOR\"", "at most NORMAL"},
        {"matt.dae", "<vcount>3 3</vcount>", "<vcount>3</vcount>", "as many numbers"},
        {"matt.dae", "<vcount>3 3</vcount>", "<vcount>3 4</vcount>", "first three"},
        {"matt.dae", "<p>0 0 1 1 2 2 0 0 2 2 3 3</p>", "<p>0 0 1 1 2 2 0 0 3 3 3 3</p>",
         "a point twice"},
        {"matt.dae", "<p>0 0 1 1 2 2 0 0 2 2 3 3</p>", "<p>0 0 1 1 2 2 2 2 0 0 3 3</p>",
         "the same direction"},
        {"matt.dae", "<p>0 0 1 1 2 2 0 0 2 2 3 3</p>", "<p>0 0 1 1 2 2 0 0 2 2 1 1</p>",
         "no triangle uses"},
        {"matt.dae", "<p>0 0 1 1 2 2 0 0 2 2 3 3</p>", "<p>0 0 2 2 1 1 0 0 3 3 2 2</p>",
         "the normals"},
        {"ball_mesh.dae", "<vcount>3 ", "<vcount> ", "as many numbers"},
        {"matt.dae", "<instance_light url=\"#lamp\"/>",
         "<instance_geometry url=\"#near-mesh\"><bind_material><technique_common><instance_material symbol=\"m\" target=\"#matt\"/></technique_common></bind_material></instance_geometry>",
         "counted by lights"},
        {"matt.dae", "target=\"#matt\"", "target=\"#glow\"", "has an area light"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *text = read_scene(cases[i].scene), *hit = strstr(text, cases[i].from);
        if (hit == NULL)
            fail_msg("%s has no %s", cases[i].scene, cases[i].from);
        OWN_TEXT other = replaced(text, hit, hit + strlen(cases[i].from), cases[i].to);
        const char *told = course_scene_breach(other, false);
        if (strstr(told, cases[i].rule) == NULL)
            fail_msg("%s with %s: '%s', not '%s'", cases[i].scene, cases[i].to, told,
                     cases[i].rule);
        free(text);
    }
}

/* The floor's mesh replaced: two tetrahedra that touch in a point, and one with a triangle beside it: it may stand without normals. */
TEST(surfaces_have_one_fan_at_each_point)
{
    static const char mesh[] =
        "<source id=\"floor-p\"><float_array count=\"21\">0 0 0 1 0 0 0 1 0 0 0 1 -1 0 0 0 -1 0 0 0 -1</float_array>"
        "</source><vertices id=\"floor-v\"><input semantic=\"POSITION\" source=\"#floor-p\"/></vertices>"
        "<polylist count=\"%d\"><input semantic=\"VERTEX\" source=\"#floor-v\" offset=\"0\"/>%s"
        "<vcount>3 3 3 3%s</vcount><p>%s</p></polylist>";
    static const struct {
        int count;
        const char *normal, *more, *indices, *rule;
    } cases[] = {{8, "", " 3 3 3 3", "0 2 1 0 1 3 1 2 3 0 3 2 0 4 5 0 6 4 4 6 5 0 5 6", "two fans"},
                 {5, "<input semantic=\"NORMAL\" source=\"#floor-p\" offset=\"1\"/>", " 3",
                  "0 0 2 2 1 1 0 0 1 1 3 3 1 1 2 2 3 3 0 0 3 3 2 2 4 4 5 5 6 6", "is closed, or"},
                 {5, "", " 3", "0 2 1 0 1 3 1 2 3 0 3 2 4 5 6", ""}};
    char *text = read_scene("matt.dae"), *from = strstr(text, "<source id=\"floor-p\">"),
         *to = strstr(from, "</mesh>");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char inner[1000];
        snprintf(inner, sizeof inner, mesh, cases[i].count, cases[i].normal, cases[i].more,
                 cases[i].indices);
        OWN_TEXT other = replaced(text, from, to, inner);
        const char *told = course_scene_breach(other, false), *rule = cases[i].rule;
        if (rule[0] != '\0' ? strstr(told, rule) == NULL : told[0] != '\0')
            fail_msg("%s", told);
    }
    free(text);
}

TEST_GROUP(NULL, NULL)
