/* The page's table of costs: times of the engines, scene by scene. */
#include "report_internal.h"

#include "tools/results/render_cost.h"
#include "tools/html/html.h"

void report_cost(FILE *f, const json_t *results)
{
    struct scene_cost cost[MAX_COSTS];
    int num = render_cost_gather(results, cost);
    double sum = 0;
    for (int i = 0; i < num; i++)
        sum += cost[i].ours_s + cost[i].references_s;
    if (sum <= 0)
        return;
    fputs("<section>\n<h2>What the time went to</h2>\n", f);
    html_table_open(f, NULL, "Table of costs",
                    "Scene|>Ours s|>References s|>Share %|>Looks|>Samples at most|>Undecided");
    for (int i = 0; i < num; i++) {
        const struct scene_cost *c = &cost[i];
        html_row_open(f, c->undecided > 0, c->scene);
        fprintf(f,
                "<td class=\"num\">%.2f</td><td class=\"num\">%.2f</td><td "
                "class=\"num\">%.1f</td><td class=\"num\">%d</td><td class=\"num\">%.0f</td><td "
                "class=\"num\">%d of %d</td></tr>\n",
                c->ours_s, c->references_s, 100 * (c->ours_s + c->references_s) / sum, c->looks,
                c->largest_n, c->undecided, c->claims);
    }
    html_table_close(f);
    fprintf(f,
            "<p class=\"caption\">Processor seconds of rendering in this "
            "run, %.4g in all. Stored references and closed forms cost nothing here. What several "
            "claims share is counted once.</p>\n</section>\n",
            sum);
}
