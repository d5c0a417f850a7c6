#include "convergence_results.h"

#include "json_shape.h"
#include "reference/suite/suite.h"
#include "tools/base/text_table.h"

#include <string.h>

static const struct shape engine_shape = {
    .names = {[IS_TEXT] = "engine error?", [IS_BOOLEAN] = "independent judged passed"}};
static const struct shape rung_shape = {
    .names = {[IS_NUMBER] = "bias",
              [IS_POSITIVE] = "spp cpu_s",
              [IS_POSITIVE_ESTIMATE] = "rmse variance efficiency~"}};
static const struct shape measured_shape = {
    .names = {[IS_TEXT] = "reason",
              [IS_NUMBER] = "slope",
              [IS_INTERVAL] = "slope_ci floor_ci",
              [IS_VERDICT] = "slope_verdict floor_verdict verdict"},
    .part = {{"rungs", &rung_shape, PART_LIST_OF_2}}};
static const struct shape ratio_rung_shape = {
    .names = {[IS_POSITIVE] = "spp", [IS_POSITIVE_ESTIMATE] = "variance efficiency~"}};
static const struct shape ratio_shape = {
    .names = {[IS_TEXT] = "a b", [IS_VERDICT] = "variance_verdict?"},
    .part = {{"rungs", &ratio_rung_shape, PART_LIST_OF_2}}};
static const struct shape scene_shape = {
    .names = {[IS_TEXT] = "scene reference",
              [IS_NUMBER] =
                  "width height depth replicates reference_noise alpha margin slope_margin"},
    .part = {{"engines", &engine_shape, PART_LIST_OF_1}, {"ratios", &ratio_shape, PART_LIST}}};
static const struct shape depth_shape = {
    .names = {[IS_NUMBER] = "mean se truth?", [IS_COUNT] = "depth"}};
static const struct shape depths_shape = {.names = {[IS_COUNT] = "samples"},
                                          .part = {{"rungs", &depth_shape, PART_LIST_OF_1}}};

bool convergence_results_check_depths(const json_t *depths, const char *where, struct err *e)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    char within[700];
    snprintf(within, sizeof within, "%.650s: 'depths'", where);
    if (json_is_string(json_object_get(depths, "error")))
        return true;
    if (!json_shape_check(depths, &depths_shape, within, e))
        return false;
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i);
        if (i > 0 &&
            member_number(g, "depth") <= member_number(json_array_get(rungs, i - 1), "depth"))
            return err_set(e, "%s: 'depth' does not ascend", within);
        if (member_number(g, "se") < 0)
            return err_set(e, "%s: 'se' is below 0", within);
    }
    return true;
}

static bool check_scene(const json_t *s, const char *where, struct err *e)
{
    if (!json_shape_check(s, &scene_shape, where, e))
        return false;
    const json_t *engines = json_object_get(s, "engines"), *depths = json_object_get(s, "depths");
    json_each(j, engines) {
        char inner[600];
        snprintf(inner, sizeof inner, "%.500s, %.60s", where, member_text(j, "engine"));
        if (!json_shape_check_row(j, &measured_shape, inner, e))
            return false;
    }
    return depths == NULL || convergence_results_check_depths(depths, where, e);
}

bool convergence_results_check(const json_t *convergence, const char *path, struct err *e)
{
    if (json_array_size(convergence) == 0)
        return err_set(e, "%s: 'convergence' is not an array with at least one scene", path);
    json_each(s, convergence) {
        const char *scene = member_text(s, "scene");
        char where[512];
        snprintf(where, sizeof where, "%.300s: convergence of %.60s", path,
                 scene != NULL ? scene : "?");
        if (!check_scene(s, where, e))
            return false;
    }
    return true;
}

static enum outcome outcome_of(const char *verdict)
{
    if (strcmp(verdict, "DIFFERENT") == 0)
        return OUTCOME_OPPOSITE;
    return strcmp(verdict, "INCONCLUSIVE") == 0 ? OUTCOME_UNDECIDED : OUTCOME_AS_EXPECTED;
}

/* "name [lo, hi]", or without the interval where there is none; "-" where there is no number. */
static void format_value(char *text, size_t size, const json_t *object, const char *name,
                         const char *interval)
{
    if (!json_is_number(json_object_get(object, name)))
        snprintf(text, size, "-");
    else if (json_array_size(json_object_get(object, interval)) == 2)
        snprintf(text, size, "%.3g [%.3g, %.3g]", member_number(object, name),
                 member_end(object, interval, 0), member_end(object, interval, 1));
    else
        snprintf(text, size, "%.3g", member_number(object, name));
}

struct sink {
    void (*row)(void *ctx, const struct convergence_row *r);
    void *ctx;
};

static void emit(const struct sink *s, const char *scene, const char *engine, const char *quantity,
                 const char *value, const char *verdict)
{
    const struct convergence_row r = {scene, engine, quantity, value, verdict, outcome_of(verdict)};
    s->row(s->ctx, &r);
}

static void engine_rows(const struct sink *s, const json_t *scene, const json_t *j)
{
    const char *name = member_text(scene, "scene"), *engine = member_text(j, "engine");
    char text[160], quantity[64];
    if (json_object_get(j, "error") != NULL) {
        const struct convergence_row r = {
            name, engine, "convergence", member_text(j, "error"), "NOT JUDGED", OUTCOME_NOT_JUDGED};
        s->row(s->ctx, &r);
        return;
    }
    const json_t *rungs = json_object_get(j, "rungs");
    const json_t *top = json_array_get(rungs, json_array_size(rungs) - 1);
    snprintf(text, sizeof text, "%+.4f [%+.4f, %+.4f]", member_number(j, "slope"),
             member_end(j, "slope_ci", 0), member_end(j, "slope_ci", 1));
    emit(s, name, engine, "slope of RMSE", text, member_text(j, "slope_verdict"));
    snprintf(quantity, sizeof quantity, "RMS bias at %g spp, %%", member_number(top, "spp"));
    snprintf(text, sizeof text, "%.3f [%.3f, %.3f]", 100 * member_number(top, "bias"),
             100 * member_end(j, "floor_ci", 0), 100 * member_end(j, "floor_ci", 1));
    emit(s, name, engine, quantity, text, member_text(j, "floor_verdict"));
}

static void ratio_row(const struct sink *s, const char *scene, const json_t *ratio, size_t rung,
                      const char *name, const char *interval, const char *verdict)
{
    const json_t *g = json_array_get(json_object_get(ratio, "rungs"), rung);
    char quantity[128], text[160];
    snprintf(quantity, sizeof quantity, "%s / %s's at %g spp", name, member_text(ratio, "b"),
             member_number(g, "spp"));
    format_value(text, sizeof text, g, name, interval);
    emit(s, scene, member_text(ratio, "a"), quantity, text,
         verdict != NULL ? verdict : json_shape_measured);
}

static void ratio_rows(const struct sink *s, const char *scene, const json_t *ratio)
{
    size_t last = json_array_size(json_object_get(ratio, "rungs")) - 1;
    ratio_row(s, scene, ratio, 0, "variance", "variance_ci", NULL);
    ratio_row(s, scene, ratio, last, "variance", "variance_ci",
              member_text(ratio, "variance_verdict"));
    ratio_row(s, scene, ratio, last, "efficiency", "efficiency_ci", NULL);
}

void convergence_results_rows(const json_t *scene,
                              void (*row)(void *ctx, const struct convergence_row *r), void *ctx)
{
    const struct sink s = {row, ctx};
    const json_t *engines = json_object_get(scene, "engines");
    const json_t *ratios = json_object_get(scene, "ratios");
    for (size_t k = 0; k < json_array_size(engines); k++)
        engine_rows(&s, scene, json_array_get(engines, k));
    for (size_t k = 0; k < json_array_size(ratios); k++)
        ratio_rows(&s, member_text(scene, "scene"), json_array_get(ratios, k));
}

const char *convergence_results_reason(const json_t *engine)
{
    return json_is_true(json_object_get(engine, "passed")) ? NULL : member_text(engine, "reason");
}

static void print_rungs(FILE *f, const json_t *scene)
{
    fprintf(f, "\n%-17s %6s  %-26s %-26s %8s %9s  %s\n", "engine", "spp", "RMSE % [interval]",
            "variance [interval]", "bias %", "CPU ms", "efficiency 1/s [interval]");
    const json_t *engines = json_object_get(scene, "engines");
    json_each(j, engines) {
        const json_t *rungs = json_object_get(j, "rungs");
        json_each(g, rungs) {
            char rmse[64], variance[64], efficiency[64];
            snprintf(rmse, sizeof rmse, "%.4g [%.4g, %.4g]", 100 * member_number(g, "rmse"),
                     100 * member_end(g, "rmse_ci", 0), 100 * member_end(g, "rmse_ci", 1));
            format_value(variance, sizeof variance, g, "variance", "variance_ci");
            format_value(efficiency, sizeof efficiency, g, "efficiency", "efficiency_ci");
            fprintf(f, "%-17s %6g  %-26s %-26s %8.3f %9.1f  %s\n", member_text(j, "engine"),
                    member_number(g, "spp"), rmse, variance, 100 * member_number(g, "bias"),
                    1e3 * member_number(g, "cpu_s"), efficiency);
        }
    }
}

static void print_row(void *ctx, const struct convergence_row *r)
{
    fprintf(ctx, "%-17s %-38s %-28s %s\n", r->engine, r->quantity, r->value, r->verdict);
}

void convergence_results_print(FILE *f, const json_t *convergence)
{
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *s = json_array_get(convergence, i);
        fprintf(f,
                "%s%s: %.0f x %.0f pixels, %.0f bounces, %.0f replicates a rung\n"
                "reference: %s, RMS noise %.3g %%; intervals at %.6g %% each\n",
                i > 0 ? "\n" : "", member_text(s, "scene"), member_number(s, "width"),
                member_number(s, "height"), member_number(s, "depth"),
                member_number(s, "replicates"), member_text(s, "reference"),
                100 * member_number(s, "reference_noise"), 100 * (1 - member_number(s, "alpha")));
        print_rungs(f, s);
        fprintf(f, "\n%-17s %-38s %-28s %s\n", "engine", "quantity", "value [interval]", "verdict");
        convergence_results_rows(s, print_row, f);
        json_each(j, json_object_get(s, "engines"))
            if (convergence_results_reason(j) != NULL)
                fprintf(f, "\n%s: %s\n", member_text(j, "engine"), convergence_results_reason(j));
    }
}

static void print_markdown_row(void *ctx, const struct convergence_row *r)
{
    const char *cell[] = {r->scene, r->engine, r->quantity, r->value, r->verdict};
    FILE *f = ctx;
    for (size_t i = 0; i < sizeof cell / sizeof *cell; i++) {
        fputs("| ", f);
        if (i == 3) /* "-0.5 [-0.51, -0.49]" */
            fputs(cell[i], f);
        else
            text_table_escape(f, cell[i]);
        fputc(' ', f);
    }
    fputs("|\n", f);
}

void convergence_results_print_markdown(FILE *f, const json_t *convergence)
{
    fputs("| scene | engine | quantity | value [interval] | verdict |\n|---|---|---|--:|---|\n", f);
    for (size_t i = 0; i < json_array_size(convergence); i++)
        convergence_results_rows(json_array_get(convergence, i), print_markdown_row, f);
}
