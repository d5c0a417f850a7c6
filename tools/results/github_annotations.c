#include "github_annotations.h"

#include "plain_words.h"
#include "results.h"

/* Percent-encodes whatever would end the command or, in a property, the property. */
static void print_escaped(FILE *f, const char *s, bool property)
{
    for (; s != NULL && *s != '\0'; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '%' || c < 0x20 || c == 0x7f || (property && (c == ':' || c == ',')))
            fprintf(f, "%%%02X", c);
        else
            fputc(c, f);
    }
}

static void print_title(FILE *f, const struct results_walk *w)
{
    fprintf(f,
            "::%s title=", w->outcome == OUTCOME_UNDECIDED || w->lacks_time ? "warning" : "error");
    print_escaped(f, w->scene, true);
    fputs("%3A ", f);
}

static void print_claim(FILE *f, const struct results_walk *w)
{
    const json_t *claim = w->json, *claims = json_object_get(w->results, "claims");
    size_t num = w->outcome == OUTCOME_NOT_JUDGED ? results_num_with_error(claims, w->index) : 1;
    if (num == 0)
        return;
    print_title(f, w);
    print_escaped(f, member_text(claim, "a"), true);
    fputs(" against ", f);
    print_escaped(f, member_text(claim, "b"), true);
    if (num > 1)
        fprintf(f, " and %zu more", num - 1);
    fputs("::", f);
    if (w->outcome == OUTCOME_NOT_JUDGED) {
        fputs(w->lacks_time ? "INCONCLUSIVE: " : "could not be judged: ", f);
        print_escaped(f, member_text(claim, "error"), false);
    } else {
        print_escaped(f, member_text(claim, "verdict"), false);
        fputs(", expected ", f);
        print_escaped(f, member_text(claim, "expected"), false);
        fputs(": ", f);
        print_escaped(f, member_text(claim, "reason"), false);
        fprintf(f, " (difference %+.3g %%25)", 100 * member_number(claim, "difference"));
        const struct plain_words more = plain_words_more_samples(claim);
        fputs(more.s[0] != '\0' ? "; " : "", f);
        print_escaped(f, more.s, false);
    }
    if (member_text(claim, "rerun") != NULL) {
        fputs("%0Aagain: ", f);
        print_escaped(f, member_text(claim, "rerun"), false);
    }
    fputc('\n', f);
}

void github_annotations_headline(FILE *f, const json_t *results)
{
    size_t count[OUTCOME_AS_EXPECTED + 1] = {0}, num = 0;
    for (struct results_walk w = {.results = results}; results_next(&w); num++)
        count[w.lacks_time ? OUTCOME_UNDECIDED : w.outcome]++;
    if (count[OUTCOME_AS_EXPECTED] == num)
        fprintf(f, "All %zu claims came out as expected.", num);
    else
        fprintf(f,
                "Of %zu claims %zu came out wrong, %zu stayed undecided and %zu could not be "
                "judged.",
                num, count[OUTCOME_OPPOSITE], count[OUTCOME_UNDECIDED], count[OUTCOME_NOT_JUDGED]);
}

static void print_other(FILE *f, const struct results_walk *w)
{
    static const char *const what[NUM_JUDGED] = {[JUDGED_STATED_ERROR] = "stated errors",
                                                 [JUDGED_NOISE] = "noise",
                                                 [JUDGED_CONVERGENCE] = "convergence"};
    const char *error = member_text(w->json, "error"), *verdict = member_text(w->json, "verdict");
    print_title(f, w);
    fprintf(f, "%s::", what[w->kind]);
    print_escaped(f, error != NULL ? error : verdict != NULL ? verdict : "not as expected", false);
    fputc('\n', f);
}

void github_annotations_print(FILE *f, const json_t *results)
{
    for (struct results_walk w = {.results = results}; results_next(&w);)
        if (w.outcome != OUTCOME_AS_EXPECTED) {
            if (w.kind == JUDGED_CLAIM)
                print_claim(f, &w);
            else
                print_other(f, &w);
        }
    fputs("::notice title=assay::", f);
    github_annotations_headline(f, results);
    fputc('\n', f);
}
