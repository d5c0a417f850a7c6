/* Writes the page of the calibration: measured error rates with their confidence intervals. */
#include "calibrate.h"

#include "tests/support/rates.h"

#include "renderer/base/fs.h"
#include "renderer/base/version.h"

#include <math.h>
#include <string.h>

/* One table cell, the rate and its 99.9 % Clopper-Pearson interval: "0.0103 [0.0081, 0.0128]". */
static void rate_cell(FILE *f, double k, double n)
{
    if (n > 0)
        fprintf(f, " %.3g [%.2g, %.2g] |", k / n, rate_lower(k, n, check_tail),
                rate_upper(k, n, check_tail));
    else
        fputs(" |", f);
}

static void heading(FILE *f, const char *command, const struct settings *s,
                    const struct checks *all)
{
    char hex[65];
    settings_hash(s, hex);
    fprintf(
        f,
        "# Calibration of the tester\n"
        "How often `assay compare` is wrong, how small a bias it finds, and whether what it prints "
        "about itself is true, measured\non images whose truth is known. Written by `%s`; do not "
        "edit.\n\nCode: %s. Settings: `%s`.\n\n",
        command, assay_version, hex);
    if (all->failed == 0)
        fprintf(f, "**All %d acceptance lines hold.**\n\n", all->num);
    else
        fprintf(f, "**%d of %d acceptance lines do not hold**, see the end.\n\n", all->failed,
                all->num);
    fprintf(
        f,
        "Numbers in brackets are Clopper-Pearson intervals of 99.9 %%. A rate that must not exceed "
        "a bound \"holds\" unless its\ninterval lies above it. If every rate were exactly at its "
        "bound, %.2f of the %d lines would fail by chance. Everything\ndepends on the seeds alone, "
        "not on the machine or the number of threads.\n\n",
        all->num * check_tail, all->num);
}

static void null_table(FILE *f, const struct null_result *r, int num)
{
    fputs("| pairs | alpha 0.01 | alpha 0.001 | alpha 0.0001 | judged | |\n"
          "|---|---|---|---|--:|---|\n",
          f);
    for (int i = 0; i < num; i++) {
        struct checks c = {.num = 0};
        fprintf(f, "| %s |", r[i].name);
        for (int l = 0; l < NUM_LEVELS; l++)
            rate_cell(f, r[i].rejected[COLUMN_GATE][l], r[i].pairs[l]);
        null_check(&r[i], &c);
        fprintf(f, " %.0f %% | %s |\n",
                100 * r[i].tested[COLUMN_GATE][LEVEL_SHAPE] / r[i].pairs[LEVEL_SHAPE],
                checks_word(&c, 0));
    }
    fputs("\n", f);
}

static void column_table(FILE *f, const struct null_result *r)
{
    fputs("| statistic | p <= 0.01 | p <= 0.001 | p <= 0.0001 |\n|---|---|---|---|\n", f);
    for (int c = 0; c < COLUMN_TILE; c++) {
        if (r->tested[c][LEVEL_SHAPE] == 0)
            continue;
        fprintf(f, "| %s |", column_name[c]);
        for (int l = 0; l < NUM_LEVELS; l++)
            rate_cell(f, r->rejected[c][l], r->pairs[l]);
        fputs("\n", f);
    }
    fputs("\n", f);
}

/* Prints the table of rejections by every statistic in every cell. */
static void count_table(FILE *f, const struct null_result *r, int num)
{
    fputs("| pairs |", f);
    for (int c = 0; c < COLUMN_TILE; c++)
        fprintf(f, " %s |", column_name[c]);
    fputs("\n|---|", f);
    for (int c = 0; c < COLUMN_TILE; c++)
        fputs("---|", f);
    fputs("\n", f);
    for (int i = 0; i < num; i++) {
        fprintf(f, "| %s |", r[i].name);
        for (int c = 0; c < COLUMN_TILE; c++)
            if (r[i].tested[c][LEVEL_SHAPE] > 0)
                fprintf(f, " %.0f, %.0f, %.0f |", r[i].rejected[c][0], r[i].rejected[c][1],
                        r[i].rejected[c][2]);
            else
                fputs(" |", f);
        fputs("\n", f);
    }
    fputs("\n", f);
}

static void false_alarms(FILE *f, const struct settings *s, const struct results *r)
{
    struct null_result pooled;
    null_pool(r->render, s->num_render, "all", &pooled);
    fprintf(
        f,
        "## False alarms: real renders\n"
        "%.0f pairs of renders of scenes of the suite from disjoint seeds; margins 0 (variance: 0.1 %%), tiles of 8 "
        "pixels. \"64 and 64\": samples per\npixel of A and B; \"32 and 8 x 32\": B is 8 replicates "
        "of 32 samples. The gate: rate of DIFFERENT.\n\n",
        pooled.pairs[0]);
    null_table(f, r->render, s->num_render);
    fputs(
        "All of them together, by statistic (p times the number of its tests; \"mean alone\" is the "
        "image's luminance, one test):\n\n",
        f);
    column_table(f, &pooled);
    null_pool(r->synthetic, s->num_synthetic, "all", &pooled);
    fprintf(
        f,
        "## False alarms: synthetic laws\n"
        "%zu pairs a row at alpha 0.01 and %zu at 0.001, from which 0.0001 is read off (a comparison at "
        "0.0001 would test fewer regions, only\nthe less skewed). 16 x 16 pixels, tiles of 8, every "
        "second pair grey, the others with independent channels; n observations a pixel\non each side; "
        "margins 0 (variance: 0.1 %%). Laws of mean 1: normal (sd 0.3), exponential, 90 %% black and else "
        "exponential,\nexponential of mean 0.5 with 0.1 %% of Pareto fireflies (mean 500, index 2.5), "
        "lognormal (sigma 1). Pixels are put together from a\nlibrary of %zu blocks of 16 or 64 "
        "draws, of which each pair renews 128 (tests/support/synthetic_images.h); \"exact\" is the library's mean. "
        "\"Judged\":\npairs in which anything could be tested; in the others all was too skewed.\n\n",
        s->synthetic_pairs[0], s->synthetic_pairs[1], s->blocks);
    null_table(f, r->synthetic, s->num_synthetic);
    fputs(
        "![False alarms of the gate against alpha, by law](false_alarms.svg)\n\nAll laws together, by "
        "statistic:\n\n",
        f);
    column_table(f, &pooled);
    fputs("Counts of p <= 0.01, 0.001, 0.0001, each statistic by itself:\n\n", f);
    count_table(f, r->synthetic, s->num_synthetic);
}

static void tails(FILE *f, const struct settings *s, const struct results *r)
{
    fputs(
        "## Far tails\nSingle regions of 64 pixels in one channel that the skew guard passes at 1e-6: "
        "the rate of p below a level, over that level.\nThe guard promises p within a factor of "
        "e^0.2 = 1.22, and that is the bound.\n\n"
        "| law and n | regions tested | at 1e-4 | at 1e-5 | at 1e-6 | |\n|---|--:|---|---|---|---|\n",
        f);
    for (int i = 0; i < s->num_tail; i++) {
        const struct tail_result *t = &r->tail[i];
        struct checks c = {.num = 0};
        tail_check(t, &c);
        fprintf(f, "| %s | %.0f of %.0f |", t->name, t->tested, t->regions);
        for (int l = 0; l < 3; l++)
            if (t->tested > 0)
                fprintf(f, " %.2f [%.2f, %.2f] |", t->rejected[l] / t->tested / tail_level[l],
                        rate_lower(t->rejected[l], t->tested, check_tail) / tail_level[l],
                        rate_upper(t->rejected[l], t->tested, check_tail) / tail_level[l]);
            else
                fputs(" |", f);
        fprintf(f, " %s |\n", checks_word(&c, 0));
    }
    fputs("\n![Rate over p, by law](tail.svg)\n\n", f);
}

static void uniformity(FILE *f, const struct settings *s, const struct results *r)
{
    fputs("## Uniformity of p\n\"Excess\": the largest amount by which the share of pairs with a p "
          "below x exceeds x, over all x; at most 0.01 beyond what chance\ndoes (1.95 / sqrt n). "
          "Statistics of many tests are Bonferroni's, so theirs lies below. The one-sided p of the "
          "mean of grey\nimages must be uniform under the normal law (Kolmogorov-Smirnov and "
          "Anderson-Darling, p > 0.001); for skewed laws it is only\nshown.\n\n"
          "| law and n |",
          f);
    for (int c = 0; c < NUM_COLUMNS; c++)
        fprintf(f, " %s |", column_name[c]);
    fputs(" KS p | A^2 | AD p |\n|---|", f);
    for (int c = 0; c < NUM_COLUMNS + 3; c++)
        fputs("--:|", f);
    fputs("\n", f);
    for (int i = 0; i < s->num_synthetic; i++) {
        const struct null_result *n = &r->synthetic[i];
        fprintf(f, "| %s |", n->name);
        for (int c = 0; c < NUM_COLUMNS; c++)
            if (n->tested[c][LEVEL_SHAPE] > 0)
                fprintf(f, " %.4f |", n->above[c]);
            else
                fputs(" |", f);
        if (n->num_one_sided > 0)
            fprintf(f, " %.2g | %.2f | %.2g |\n", n->ks_p, n->ad, n->ad_p);
        else
            fputs(" | | |\n", f);
    }
    fputs("\n![Observed rates against p](statistics.svg)\n\n", f);
}

static void power(FILE *f, const struct settings *s, const struct results *r)
{
    fprintf(
        f,
        "## Power\nRate of DIFFERENT when A is brighter by a share of the MDB that is printed for "
        "pairs without a bias; alpha 0.001, %zu pairs a\npoint, 32 x 32 pixels, tiles of 16. Asked: "
        "at the MDB at least 95 %%; at 1.1 of it proved to be more, at 0.9 proved to be less, so\n"
        "that the bias found with 95 %% is within 10 %% of the MDB. With independent channels the MDB "
        "is only an upper bound (tools/docs/background/verdict.md).\n\n"
        "| n and bias | MDB | at 0.9 | at the MDB | at 1.1 | found with 95 %% | |\n"
        "|---|--:|---|---|---|--:|---|\n",
        s->power_pairs);
    for (int i = 0; i < s->num_power; i++) {
        const struct power_result *p = &r->power[i];
        struct checks c = {.num = 0};
        power_check(p, &c);
        fprintf(f, "| %s | %.3g %% |", p->name, 100 * p->mdb);
        for (int k = 0; k < POWER_POINTS; k++)
            if (power_bias[k] >= 0.9 && power_bias[k] <= 1.1)
                rate_cell(f, p->found[k], p->pairs);
        fprintf(f, " %.3f MDB | %s |\n", power_95(p), checks_word(&c, 0));
    }
    fputs("\n![Power against bias over MDB](power.svg)\n\n", f);
}

static void intervals(FILE *f, const struct settings *s, const struct results *r)
{
    fprintf(
        f,
        "## Intervals and EQUIVALENT\nEqual means: how often the interval of the image, and that of "
        "a tile of 8 x 8 pixels, leaves 0 out. %zu pairs a row. \"With\":\npairs in which there "
        "was an interval at all.\n\n"
        "| law and n | interval | image: with | misses | tile: with | misses | |\n"
        "|---|--:|--:|---|--:|---|---|\n",
        s->cover_pairs);
    for (int i = 0; i < s->num_cover; i++) {
        const struct cover_result *v = &r->cover[i];
        struct checks c = {.num = 0};
        cover_check(v, &c);
        fprintf(f, "| %s | %g %% |", v->name, 100 * (1 - 2 * v->alpha));
        for (int k = 0; k < 2; k++) {
            fprintf(f, " %.0f %% |", 100 * v->valid[k] / v->pairs);
            rate_cell(f, v->missed[k], v->valid[k]);
        }
        fprintf(f, " %s |\n", checks_word(&c, 0));
    }
    fprintf(
        f,
        "\nA bias just outside the margin (1e-6 of it): how often it is called EQUIVALENT, and "
        "DIFFERENT, which at the edge is wrong as well.\nBoth at most alpha. %zu pairs a row.\n\n"
        "| law and n | alpha | EQUIVALENT, image outside | tile outside | DIFFERENT, image | tile | "
        "EQUIVALENT without bias | |\n|---|--:|---|---|---|---|--:|---|\n",
        s->margin_pairs);
    for (int i = 0; i < s->num_margin; i++) {
        const struct margin_result *m = &r->margin[i];
        struct checks c = {.num = 0};
        margin_check(m, &c);
        fprintf(f, "| %s | %g |", m->name, m->alpha);
        for (int k = 0; k < 2; k++)
            rate_cell(f, m->equivalent[k], m->pairs);
        for (int k = 0; k < 2; k++)
            rate_cell(f, m->different[k], m->pairs);
        fprintf(f, " %.1f %% | %s |\n", 100 * m->equivalent[2] / m->pairs, checks_word(&c, 0));
    }
    fputs("\n", f);
}

static void exchanges(FILE *f, const struct settings *s, const struct results *r, bool is_flips)
{
    for (int i = 0; i < s->num_permutation; i++) {
        const struct permutation_result *p = &r->permutation[i];
        struct checks c = {.num = 0};
        if (p->is_flips != is_flips)
            continue;
        permutations_check(p, &c);
        fprintf(f, "| %s |", p->name);
        for (int l = 0; l < NUM_PERMUTATION_LEVELS; l++)
            rate_cell(f, p->rejected[l], p->pairs);
        fprintf(f, " %s |\n", checks_word(&c, 0));
    }
}

static void gates(FILE *f, const struct settings *s, const struct results *r)
{
    fprintf(
        f,
        "## Two stages, and permutation\nTwo stages with fresh seeds (tools/sequential/two_stage.h): flagged by the "
        "first with at most the root of alpha, DIFFERENT with at most alpha;\n%zu pairs a row.\n\n"
        "| law and n | alpha | flagged | DIFFERENT | |\n|---|--:|---|---|---|\n",
        s->stages_pairs);
    for (int i = 0; i < s->num_stages; i++) {
        const struct stages_result *g = &r->stages[i];
        struct checks c = {.num = 0};
        stages_check(g, &c);
        fprintf(f, "| %s | %g |", g->name, g->alpha);
        rate_cell(f, g->flagged, g->pairs);
        rate_cell(f, g->different, g->pairs);
        fprintf(f, " %s |\n", checks_word(&c, 0));
    }
    fprintf(
        f,
        "\nPermutation of 6 and 6 replicates (tools/exact/permutation.h), 8 x 8 pixels of one draw each; "
        "%zu pairs a row. The test is exact, so the rate\nis at most alpha whatever the law.\n\n"
        "| law | alpha 0.1 | alpha 0.05 | alpha 0.01 | |\n|---|---|---|---|---|\n",
        s->permutation_pairs);
    exchanges(f, s, r, false);
    if (s->num_permutation > 0 && r->permutation[s->num_permutation - 1].is_flips) {
        fputs(
            "\nFlips of pixels (tools/exact/sign_flip.h), as many pairs of images of 16 x 16, each pixel the mean of so many "
            "draws.\n\n| law and n | alpha 0.01 | alpha 0.001 | alpha 0.0001 | |\n|---|---|---|---|---|\n",
            f);
        exchanges(f, s, r, true);
    }
    fputs("\n", f);
}

static void weakened(FILE *f, const struct weak_results *weak)
{
    fputs(
        "## A weakened tester is caught\nThe short version of this calibration, which `make check` "
        "runs too, on the tester as it is and on testers weakened on purpose.\n\n"
        "| tester | lines that do not hold | the first of them |\n|---|--:|---|\n",
        f);
    for (int i = 0; i < NUM_WEAKNESSES; i++) {
        const struct checks *c = &weak->checks[i];
        const char *first = "";
        for (int k = c->num - 1; k >= 0; k--)
            if (!c->item[k].holds)
                first = c->item[k].what;
        fprintf(f, "| %s | %d of %d | %s |\n", weakness_name[i], c->failed, c->num, first);
    }
}

bool page_write(const char *dir, const char *command, const struct settings *s,
                const struct results *r, const struct checks *all, const struct weak_results *weak,
                struct err *e)
{
    struct out_file out;
    if (!fs_make_dirs(dir, e) || !page_draw(dir, s, r, e) ||
        !out_open(&out, fs_path("%s/README.md", dir).s, e))
        return false;
    heading(out.f, command, s, all);
    false_alarms(out.f, s, r);
    tails(out.f, s, r);
    uniformity(out.f, s, r);
    power(out.f, s, r);
    intervals(out.f, s, r);
    gates(out.f, s, r);
    weakened(out.f, weak);
    if (all->failed > 0) {
        fputs("\n## What does not hold\n", out.f);
        for (int i = 0; i < all->num; i++)
            if (!all->item[i].holds)
                fprintf(out.f, "- %s\n", all->item[i].what);
    }
    return out_commit(&out, e);
}
