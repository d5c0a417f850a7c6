/* suite.json: what is read, what is taken from the suite where a scene does not say it, and a line with file and place for each mistake. */
#include "tests/support/own.h"
#include "tests/support/test.h"

#include "reference/suite/suite_own.h"
#include "renderer/base/fs.h"

static const char good[] =
    "{'version': 1, 'engine': 'mine.json', 'margin': 0.01, 'margin_variance': 0.5,\n"
    " 'references': {'mine-1.4': {'spp': 64}},\n"
    " 'scenes': {\n"
    "  'room': {'file': 'room.xml', 'uses': ['wood.png'], 'width': 64, 'height': 32},\n"
    "  'ball': {'file': 'ball.dae', 'width': 64, 'height': 32, 'depth': 1, 'margin': 0.3,\n"
    "           'references': {'mine-1.4': {'replicates': 128, 'margin_tile': 0.5, 'margin_variance': 2},\n"
    "                          'povray': {'replicates': 8, 'subgrid': 2}}},\n"
    "  'dark': {'file': 'ball.dae', 'width': 64, 'height': 32, 'expect': 'DIFFERENT',\n"
    "           'references_of': 'ball'}\n"
    " }}\n";

static void put(const char *name, const char *text)
{
    test_write_text(test_path(name), text);
}

static void put_files(const char *suite)
{
    static const char *const names[] = {"mine.json", "room.xml", "wood.png", "ball.dae"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        put(names[i], names[i]);
    test_write_json(test_path("suite.json"), suite);
}

TEST(a_suite_of_ones_own_is_read)
{
    OWN(suite) s;
    struct err e;
    put_files(good);
    MUST(suite_load(test_path("."), &s, &e));
    assert_true(s.is_own);
    assert_non_null(strstr(s.engine, "/mine.json"));
    assert_int_equal(s.num_scenes, 3);
    const struct suite_scene *ball = &s.scene[0], *dark = &s.scene[1], *room = &s.scene[2];
    assert_string_equal(ball->name, "ball");
    assert_string_equal(room->name, "room");
    assert_true(room->is_opaque && !ball->is_opaque);
    assert_string_equal(room->title, "room");
    assert_int_equal(room->depth, 5);
    assert_int_equal(room->tile, 16);
    assert_int_equal(room->num_references, 1);
    assert_string_equal(room->reference[0].engine, "mine-1.4");
    assert_string_equal(room->reference[0].fidelity, "exact");
    assert_true(room->reference[0].margin_global == 0.01 && room->reference[0].margin_tile == 0.04);
    assert_true(room->reference[0].margin_variance == 0.5);
    assert_int_equal(room->reference[0].spp, 64);
    assert_int_equal(room->reference[0].replicates, 0);
    const struct suite_reference *mine = suite_reference_of(ball, "mine-1.4"),
                                 *povray = suite_reference_of(ball, "povray");
    assert_int_equal(ball->num_references, 2);
    assert_true(mine->margin_global == 0.3 && mine->margin_tile == 0.5 &&
                mine->margin_variance == 2);
    assert_int_equal(mine->spp, 64);
    assert_int_equal(mine->replicates, 128);
    assert_true(povray->margin_tile == 0.99); /* four times 0.3, but below 1 */
    assert_int_equal(dark->expect, VERDICT_DIFFERENT);
    assert_string_equal(dark->references_of, "ball");
    assert_int_equal(dark->num_references, 2);
}

/* As some editors write it. */
TEST(a_byte_order_mark_is_no_error)
{
    static const char *const marks[] = {"\xef\xbb\xbf", "\xef\xbb", "\xef\xbb\xbf\xef\xbb\xbf"};
    char text[sizeof good + 8];
    struct err e;
    put_files(good);
    for (int i = 0; i < 3; i++) {
        OWN(suite) s;
        snprintf(text, sizeof text, "%s%s", marks[i], good);
        test_write_json(test_path("suite.json"), text);
        if (i == 0)
            MUST(suite_load(test_path("."), &s, &e));
        else
            REFUSES(suite_load(test_path("."), &s, &e), "suite.json:1: ");
    }
}

/* A reference is stale when any file of its scene has changed, and no other. */
TEST(files_that_a_scene_uses_are_in_its_hash)
{
    OWN(suite) s, t;
    struct err e;
    put_files(good);
    MUST(suite_load(test_path("."), &s, &e));
    put("wood.png", "oak");
    MUST(suite_load(test_path("."), &t, &e));
    assert_string_not_equal(s.scene[2].sha256, t.scene[2].sha256);
    assert_string_equal(s.scene[0].sha256, t.scene[0].sha256);
}

/* `from` becomes `to`; a part of the line that must come out, file name first. */
static const struct fault {
    const char *from, *to, *message;
} faults[] = {
    {"'version': 1", "'version': 2", "suite.json: 'version' is 2, not in 1..1"},
    {"'version'", "'verison'", "suite.json: unknown key 'verison'"},
    {"}}\n", "}\n", "suite.json:11: '}' expected near end of file"},
    {"'room'", "'ball'", "suite.json:5: duplicate object key"},
    {"'mine.json'", "'gone.json'", "gone.json', which cannot be read"},
    {"'mine.json'", "7", "suite.json: 'engine' is not a text"},
    {"'margin': 0.01", "'margin': 1", "suite.json: 'margin' is 1, not between 0 and 1"},
    {"'margin_variance': 2", "'margin_variance': 0",
     "margin_variance' is 0, not between 0 and 100"},
    {"'margin': 0.01,", "",
     "suite.json: 'scenes.room.references.mine-1.4.margin' is given neither"},
    {"'references': {'mine-1.4'", "'references': {'mine 1.4'",
     "suite.json: 'scenes.room.references.mine 1.4' is no name of a reference"},
    {"{'spp': 64}", "7", "suite.json: 'scenes.room.references.mine-1.4' is not an object"},
    {"{'spp': 64}", "null", "suite.json: 'scenes.room.references' is empty"},
    {"{'spp': 64}", "{'spp': 0}", "suite.json: 'scenes.room.references.mine-1.4.spp' is 0, not in"},
    {"{'spp': 64}", "{'ssp': 64}", "suite.json: unknown key 'scenes.room.references.mine-1.4.ssp'"},
    {"{'spp': 64}", "{'class': 'good'}", "references.mine-1.4.class' is 'good', not 'exact'"},
    {"{'mine-1.4': {'spp': 64}}", "[]", "suite.json: 'references' is not an object"},
    {"'room'", "'.room'", "suite.json: 'scenes..room' is no name of a scene"},
    {"'room'", "'a/b'", "suite.json: 'scenes.a/b' is no name of a scene"},
    {"'file': 'room.xml'", "'file': 'gone.xml'", "suite.json: 'scenes.room.file' is '"},
    {"'file': 'room.xml', ", "", "suite.json: missing key 'scenes.room.file'"},
    {"['wood.png']", "'wood.png'", "suite.json: 'scenes.room.uses' is not a list of files"},
    {"'wood.png'", "7", "suite.json: 'scenes.room.uses' [0] is not a text"},
    {"'wood.png'", "'gone.png'", "gone.png: No such file"},
    {"'width': 64, 'height': 32}", "'height': 32}", "missing key 'scenes.room.width'"},
    {"'depth': 1", "'depth': 101", "suite.json: 'scenes.ball.depth' is 101, not in 0..100"},
    {"'depth': 1", "'tiles': 1", "suite.json: unknown key 'scenes.ball.tiles'"},
    {"['wood.png']", "[], 'lens_radius': 1", "'scenes.room.lens_radius' is for scenes in COLLADA"},
    {"'subgrid': 2", "'spp': 2", "unknown key 'scenes.ball.references.povray.spp'"},
    {"'DIFFERENT'", "'INCONCLUSIVE'", "'scenes.dark.expect' is 'INCONCLUSIVE', not"},
    {"'references_of': 'ball'", "'references_of': 'bell'",
     "suite.json: scenes.dark: 'references_of' names no scene: 'bell'"},
    {"'references_of': 'ball'", "'references_of': 'dark'",
     "suite.json: 'scenes.dark.references' is empty"},
};

TEST(mistakes_are_named_with_their_place)
{
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        const struct fault *f = &faults[i];
        char text[2048];
        struct suite s;
        struct err e;
        const char *at = strstr(good, f->from);
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, f->to,
                 at + strlen(f->from));
        put_files(text);
        REFUSES(suite_load(test_path("."), &s, &e), f->message);
    }
}
