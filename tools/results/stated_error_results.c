#include "stated_error_results.h"

#include "json_shape.h"
#include "reference/suite/suite.h"

#include <string.h>

static const struct shape row_shape = {.names = {[IS_TEXT] = "scene engine error?"}};
static const struct shape judged_shape = {
    .names = {[IS_TEXT] = "reason",
              [IS_NUMBER] = "renders spp alpha margin image seconds",
              [IS_ESTIMATE] = "pixels noise?",
              [IS_COUNT] = "too_early? too_late?",
              [IS_INTERVAL] = "image_range",
              [IS_VERDICT] = "verdict"}};

bool stated_error_check(const json_t *consistency, const char *path, struct err *e)
{
    if (!json_is_array(consistency))
        return err_set(e, "%s: 'consistency' is not an array", path);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        char where[512];
        snprintf(where, sizeof where, "%.400s: consistency %zu", path, i + 1);
        if (!json_shape_check(json_array_get(consistency, i), &row_shape, where, e) ||
            !json_shape_check_row(json_array_get(consistency, i), &judged_shape, where, e))
            return false;
    }
    return true;
}

/* The last columns: noise, and pixels that break the stopping rule; empty if the scene does not ask for it. */
static void print_more(FILE *f, const json_t *c, const char *before)
{
    fputs(before, f);
    if (json_object_get(c, "noise") != NULL)
        fprintf(f, "%.3f [%.3f, %.3f]", member_number(c, "noise"), member_end(c, "noise_ci", 0),
                member_end(c, "noise_ci", 1));
    fputs(before, f);
    if (json_object_get(c, "too_early") != NULL)
        fprintf(f, "%.0f + %.0f", member_number(c, "too_early"), member_number(c, "too_late"));
}

void stated_error_print(FILE *f, const json_t *consistency, bool markdown)
{
    if (json_array_size(consistency) == 0)
        return;
    fputs(markdown ? "\n| scene | renders | error squared, between renders / stated [interval] | "
                     "the same of the sum of all pixels | noise / closed form [interval] | pixels "
                     "stopped too early + too late | verdict |\n|---|--:|--:|--:|--:|--:|---|\n"
                   : "\nerror between renders / error that they state, squared; of pixels; of the "
                     "sum of all pixels\n(then noise / closed form; pixels that adaptive sampling "
                     "stopped too early + too late)\n",
          f);
    json_each(c, consistency) {
        if (member_text(c, "error") != NULL) {
            fprintf(f, markdown ? "| %s | | | | | | %s: %s |\n" : "%s  %s: %s\n",
                    member_text(c, "scene"),
                    member_text(c, "verdict") != NULL ? member_text(c, "verdict") : "NOT JUDGED",
                    member_text(c, "error"));
            continue;
        }
        fprintf(f,
                markdown ? "| %s | %.0f x %.0f spp | %.3f [%.3f, %.3f] | %.2f"
                         : "%s  %.0f x %.0f spp  %.3f [%.3f, %.3f]  %.2f",
                member_text(c, "scene"), member_number(c, "renders"), member_number(c, "spp"),
                member_number(c, "pixels"), member_end(c, "pixels_ci", 0),
                member_end(c, "pixels_ci", 1), member_number(c, "image"));
        if (markdown || json_object_get(c, "noise") != NULL ||
            json_object_get(c, "too_early") != NULL)
            print_more(f, c, markdown ? " | " : "  ");
        fprintf(f, markdown ? " | %s |\n" : "  %s\n", member_text(c, "verdict"));
    }
}
