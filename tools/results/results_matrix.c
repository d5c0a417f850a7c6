#include "results_matrix.h"

#include "reference/suite/engine_table.h"

#include <string.h>

static const json_t *find(const json_t *claims, const char *scene, const char *b)
{
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *c = json_array_get(claims, i);
        if (strcmp(member_text(c, "scene"), scene) == 0 &&
            strcmp(member_text(c, "a"), "pathtracer") == 0 && strcmp(member_text(c, "b"), b) == 0)
            return c;
    }
    return NULL;
}

static void print_cell(FILE *f, const json_t *c)
{
    if (c == NULL) {
        fputs(" |", f);
        return;
    }
    if (results_claim_outcome(c) == OUTCOME_NOT_JUDGED) {
        fputs(results_claim_lacks_time(c) ? " **INCONCLUSIVE** |" : " **NOT JUDGED** |", f);
        return;
    }
    const json_t *ci = json_object_get(c, "ci");
    double lo = json_number_value(json_array_get(ci, 0));
    double hi = json_number_value(json_array_get(ci, 1));
    bool as_expected = results_claim_outcome(c) == OUTCOME_AS_EXPECTED;
    const char *verdict = member_text(c, "verdict"), *mark = "";
    if (!as_expected)
        mark = verdict;
    else if (strcmp(verdict, "DIFFERENT") == 0)
        mark = "DIFFERENT";
    double mdb = 100 * member_number(c, "mdb_global");
    char mdb_text[16] = "-"; /* no test covers the whole image */
    if (mdb < 100)
        snprintf(mdb_text, sizeof mdb_text, "%.2f", mdb);
    fprintf(f, " %s%s%s%s%+.3f ± %.3f, %s |", as_expected ? "" : "**", mark,
            as_expected ? "" : "**", mark[0] != '\0' ? " " : "",
            100 * member_number(c, "difference"), 50 * (hi - lo), mdb_text);
}

void results_matrix_print(FILE *f, const json_t *results)
{
    const json_t *claims = json_object_get(results, "claims");
    fputs("| scene | truth |", f);
    for (int k = 0; engine_names[k] != NULL; k++)
        fprintf(f, " %s |", engine_table[k].title);
    fputs("\n|---|--:|", f);
    for (int k = 0; engine_names[k] != NULL; k++)
        fputs("--:|", f);
    fputc('\n', f);
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const char *scene = member_text(json_array_get(claims, i), "scene");
        bool is_first = true;
        for (size_t k = 0; k < i && is_first; k++)
            is_first = strcmp(member_text(json_array_get(claims, k), "scene"), scene) != 0;
        if (!is_first)
            continue;
        fprintf(f, "| %s |", scene);
        print_cell(f, find(claims, scene, "truth"));
        for (int k = 0; engine_names[k] != NULL; k++)
            print_cell(f, find(claims, scene, engine_names[k]));
        fputc('\n', f);
    }
}
