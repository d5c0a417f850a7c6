/* Costs by scene, from results written by hand; expected sums are added by hand. */
#include "tools/results/render_cost.h"
#include "tools/report/report_internal.h"
#include "tests/support/test.h"

/* Two references of one scene share a render of ours; a probe of an engine; a scene that ran out of
 * time; a claim of consistency; a claim of two files, which has no cost. */

static json_t *results(void)
{
    json_t *root = json_load_file("tests/tools/results/costs.json", 0, NULL);
    assert_non_null(root);
    return root;
}

TEST(test_gather)
{
    json_auto_t *root = results();
    struct scene_cost c[MAX_COSTS];
    assert_int_equal(render_cost_gather(root, c), 2);
    assert_string_equal(c[0].scene, "<b>");
    assert_true(c[0].ours_s == 20 && c[0].references_s == 0);
    assert_true(c[0].claims == 1 && c[0].looks == 0 && c[0].undecided == 1);
    assert_string_equal(c[1].scene, "a");
    assert_true(c[1].ours_s == 5.5 && c[1].references_s == 5);
    assert_true(c[1].claims == 3 && c[1].looks == 6 && c[1].undecided == 1);
    assert_true(c[1].largest_n == 256);
}

TEST(test_print)
{
    json_auto_t *root = results();
    char *line, *table;
    PRINTED(line, render_cost_print(f, root));
    assert_string_equal(line, "cost: <b> 20 s of 30.5 s (1 undecided), a 10 s (1 undecided) of "
                              "processor time\n");
    free(line);
    PRINTED(table, report_cost(f, root));
    assert_non_null(strstr(table, "&lt;b&gt;</th><td class=\"num\">20.00</td>"));
    assert_null(strstr(table, "<b>"));
    assert_non_null(strstr(table, "30.5 in all"));
    free(table);
    json_object_del(root, "consistency");
    json_array_clear(json_object_get(root, "claims"));
    PRINTED(line, render_cost_print(f, root), report_cost(f, root));
    assert_string_equal(line, "");
    free(line);
}
