/* Writes the page of the anchors: the smallest error that each test finds, in tables. */
#include "anchors.h"

#include "tests/support/rates.h"

#include "renderer/base/fs.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *heading, *what, *plot;
} errors[NUM_ANCHOR_ERRORS] = {
    [ANCHOR_GLOBAL] =
        {"Global brightness",
         "All light of A times 1 + b. Where a lamp or the sky is seen directly there is no noise, and one "
         "value on each side: ours and Welch's hold those to 1e-5, Mitsuba's to its floor on the variance.",
         "Global brightness error that each test finds"},
    [ANCHOR_BOUNCED] =
        {"Brightness of bounced light",
         "Light of A that has bounced times 1 + b, as a wrong factor in a BSDF or a light's density makes "
         "it; emitters and sky seen directly stay right.",
         "Error of bounced light that each test finds"},
    [ANCHOR_REGION] =
        {"Brightness of one region",
         "The same in one square of 16 x 16 pixels. The squares do not lie on any tile; pairs take them in "
         "turn, so a figure is over pairs and places together.",
         "Error of one 16 x 16 region that each test finds"},
};

static const enum anchor_rule reference_rule[] = {RULE_GATE_STRICT, RULE_GATE_TUNED};

struct text {
    char s[96];
};

static struct text size_of(double b)
{
    struct text t;
    if (!isfinite(b))
        snprintf(t.s, sizeof t.s, "not found");
    else
        snprintf(t.s, sizeof t.s, 100 * b < 100 ? "%.2g %%" : "%.0f %%", 100 * b);
    return t;
}

static struct text times(double ratio)
{
    struct text t;
    snprintf(t.s, sizeof t.s,
             ratio < 0.095  ? "%.3fx"
             : ratio < 0.95 ? "%.2fx"
             : ratio < 9.95 ? "%.1fx"
                            : "%.0fx",
             ratio);
    return t;
}

static void header(FILE *f, const struct anchor_results *r, const char *first)
{
    fprintf(f, "| %s |", first);
    for (int s = 0; s < r->num_scenes; s++)
        fprintf(f, " %s |", r->scene[s].scene);
    fputs("\n|---|", f);
    for (int s = 0; s < r->num_scenes; s++)
        fputs("---|", f);
    fputc('\n', f);
}

static void bias_row(FILE *f, const struct anchor_results *r, enum anchor_rule rule,
                     enum anchor_error kind)
{
    bool tuned = rule >= RULE_GATE_TUNED;
    fprintf(f, "| %s%s |", anchor_rules[rule].name, tuned ? " (set)" : "");
    for (int s = 0; s < r->num_scenes; s++) {
        const struct anchor_outcome *o = &r->scene[s].rule[rule],
                                    *ours = &r->scene[s].rule[reference_rule[tuned]];
        const struct anchor_bias *b = &o->bias[kind];
        if (anchors_useless(r, o)) {
            fputs(" none: false alarms |", f);
            continue;
        }
        fprintf(f, " %s", size_of(b->b).s);
        if (isfinite(b->b)) {
            char lo[96];
            snprintf(lo, sizeof lo, "%s", size_of(b->lo).s);
            *strchr(lo, ' ') = '\0'; /* the unit once */
            fprintf(f, " (%s to %s)", lo, size_of(b->hi).s);
        }
        if (rule != reference_rule[tuned] && isfinite(b->b))
            fprintf(f, ", %s", times(b->b / ours->bias[kind].b).s);
        fputs(" |", f);
    }
    fputc('\n', f);
}

static void false_alarm_row(FILE *f, const struct anchor_results *r, enum anchor_rule rule)
{
    bool tuned = rule >= RULE_GATE_TUNED;
    fprintf(f, "| %s%s |", anchor_rules[rule].name, tuned ? " (set)" : "");
    for (int s = 0; s < r->num_scenes; s++) {
        const struct anchor_outcome *o = &r->scene[s].rule[rule];
        double k = o->false_alarms, n = r->settings.num_pairs;
        fprintf(f, " %.3g %% (%.1f to %.1f)", 100 * k / n, 100 * rate_lower(k, n, 0.025),
                100 * rate_upper(k, n, 0.025));
        if (tuned)
            fprintf(f, " at %.4g", o->threshold);
        fputs(" |", f);
    }
    fputc('\n', f);
}

static void claims(FILE *f, const struct anchor_results *r)
{
    fputs(
        "## The claim\n\nOurs at alpha = 1e-6 finds a bias at least 5 times smaller than Mitsuba's "
        "rule as published, with the same\npower. Ratio of the two, and whether that holds:\n\n",
        f);
    header(f, r, "bias");
    for (int k = 0; k < NUM_ANCHOR_ERRORS; k++) {
        fprintf(f, "| %s |", errors[k].heading);
        for (int s = 0; s < r->num_scenes; s++) {
            const struct anchor_outcome *rule = r->scene[s].rule;
            double ratio = rule[RULE_MITSUBA].bias[k].b / rule[RULE_GATE_STRICT].bias[k].b;
            fprintf(f, " %s, %s |", isfinite(ratio) ? times(ratio).s : "-",
                    anchors_useless(r, &rule[RULE_MITSUBA]) ? "no comparison: false alarms"
                    : ratio >= 5                            ? "holds"
                                                            : "**does not hold**");
        }
        fputc('\n', f);
    }
    fputc('\n', f);
}

static int smallest_power(const struct anchor_results *r)
{
    int smallest = r->settings.num_pairs;
    for (int s = 0; s < r->num_scenes; s++)
        for (int k = 0; k < NUM_ANCHOR_RULES; k++)
            for (int i = 0; i < NUM_ANCHOR_ERRORS; i++) {
                const struct anchor_bias *b = &r->scene[s].rule[k].bias[i];
                if (isfinite(b->b) && b->found < smallest)
                    smallest = b->found;
            }
    return smallest;
}

static void method(FILE *f, const struct anchor_results *r)
{
    const struct anchor_settings *s = &r->settings;
    fprintf(
        f,
        "## What was done\n\n"
        "Our renderer drew each scene %d times in %d x %d pixels with %d samples and a seed of its "
        "own. %d of the renders\nonly set thresholds; the other %d are %d independent pairs (A, B) on "
        "which everything below is measured. Null: the\npair as it is. Bias: A is made wrong by b, "
        "its noise with it; the smallest b that a rule finds is looked up in\nevery pair, and the "
        "95 %% quantile over pairs is reported, with its 95 %% interval in brackets (order "
        "statistics,\nno law assumed). Where a rule misses in a pair what it finds there smaller, as ours may when "
        "the error makes regions too\nskewed to be tested, b is raised until 95 %% of the pairs are "
        "found. Asked again with that b, a rule found it in at least %d of "
        "%d pairs. Rules that need it get what\nthey ask for: Mitsuba's a reference of %d samples, "
        "as many times more than the picture as in Mitsuba's own tests\n(32000 for 488 at this "
        "size); it judges A alone against that, which is an advantage of up to sqrt 2 over rules\n"
        "that have two noisy sides. Ours, Welch and idiff compare A with B.\n\n",
        s->num_tune + 2 * s->num_pairs, s->side, s->side, s->spp, s->num_tune, 2 * s->num_pairs,
        s->num_pairs, smallest_power(r), s->num_pairs, s->reference_spp);
    fputs(
        "The rules, in our words:\n\n"
        "- **Ours**: `compare_moments()` with margins 0 ([procedure](../../../tools/docs/background/verdict.md)); "
        "alpha bounds the chance of any\n  wrong DIFFERENT.\n"
        "- **Mitsuba 3**, `src/render/tests/test_renders.py`: per pixel and XYZ channel z of A against "
        "a long reference,\n  with the reference's variance per sample, at least 1e-4, over A's "
        "samples. A channel fails at a two-sided p of\n  1 - 0.99^(1/pixels) (Sidak). The picture "
        "passes if 99.75 % of the channels pass.\n"
        "- **Welch per pixel**, after Eradiate's `ZTest`: every pixel and channel of A against B with "
        "the variances of both;\n  the smallest p, corrected after Sidak, must be above the level. "
        "Student's law with Welch's degrees of freedom stands\n  where Eradiate has the normal law, "
        "and a pixel without noise on either side, 0/0 there, is left out.\n"
        "- **Ours, same program**: what `assay compare --same-program` does "
        "([procedure](../../../tools/docs/background/verdict.md)): the signs of pixel\n  differences are flipped; any "
        "change of the law is rejected, and here the noise of A grows with it.\n"
        "- **z of tiles**: the sum of A - B over each tile of 16 x 16 pixels and channel over its standard error, normal "
        "law,\n  the smallest p times their number: what one writes in an afternoon.\n"
        "- **RMSE** of A - B over the mean of B, and the mean of **FLIP** (LDR, both images clamped to [0, 1]): no threshold "
        "is\n  published that holds at every noise, so they are only shown with one that was set.\n"
        "- **idiff as Blender**, `tests/python/modules/render_report.py`: `idiff -fail 0.016 "
        "-failpercent 1` on 8-bit sRGB PNG.\n  More than 1 % of the pixels differing by more than "
        "0.016 in any channel fail. Blender renders both sides with one\n  fixed seed, so that noise "
        "cancels; here, as between two programs, it does not. Our code of this rule is checked\n"
        "  against the program `idiff` in `tests/studies/anchors/test_anchors.c`.\n\n"
        "\"(set)\" means that the rule's own threshold was set, on the renders kept apart, so that ",
        f);
    fprintf(f,
            "%g %% of their null pairs\nare called different; the measured rate on the other pairs "
            "is in the table.\n\n",
            100 * s->tuned);
}

static void reading(FILE *f, const struct anchor_results *r)
{
    double z =
        mitsuba_critical_z(MITSUBA_LEVEL, (size_t)r->settings.side * (size_t)r->settings.side);
    fprintf(
        f,
        "## Reading the figures\n\n"
        "- Pixels that see a lamp directly have no noise. The floor of Mitsuba's rule gives their "
        "samples a standard deviation of\n  0.01: at a radiance of 10 a bias of %.2f x 0.01 / (10 "
        "sqrt %d) = %.2g %% fails them, and eleven such pixels are enough.\n  Ours gains from them through "
        "the directed statistics, which weigh pixels by their noise. A factor on all light is then found "
        "by\n  the lamp alone. On light that has bounced such pixels say nothing, which is why that has "
        "a table of its own.\n"
        "- A square on a lamp's edge holds the noisiest pixels of the picture. A sum over the square "
        "has their noise; a rule that\n  counts pixels has not. The 95 %% quantile over pairs and "
        "places is that of the hardest places.\n"
        "- The rows \"(set)\" compare at one false-alarm rate. Ours is strict at 1e-6 and gains by giving "
        "that up; Mitsuba's rule\n  gains more, because as published it hardly ever fires on equal "
        "pairs.\n\n",
        z, r->settings.spp, 100 * z * 0.01 / (10 * sqrt(r->settings.spp)));
}

static void tables(FILE *f, const struct anchor_results *r)
{
    fprintf(
        f,
        "## False alarms\n\nOf %d equal pairs, with 95 %% Clopper-Pearson interval in percent. "
        "\"at\": the threshold that was set, in the rule's own unit\n(-log10 p, z, failing channels, "
        "relative RMSE, FLIP, 1/255, percent).\n\n",
        r->settings.num_pairs);
    header(f, r, "rule");
    for (int k = 0; k < NUM_ANCHOR_RULES; k++)
        false_alarm_row(f, r, k);
    fprintf(
        f,
        "\nA rule with more than 5 %% false alarms has no smallest bias: \"none\" below. Noise of "
        "the scenes (standard deviation of one\nsample over the mean, luminance):");
    for (int s = 0; s < r->num_scenes; s++)
        fprintf(f, " %s %.2f%s", r->scene[s].scene, r->scene[s].noise,
                s + 1 < r->num_scenes ? "," : ".\n\n");
    for (int i = 0; i < NUM_ANCHOR_ERRORS; i++) {
        fprintf(f, "## %s\n\n%s Ratios are to ours at alpha 1e-6, of set rules to ours set.\n\n",
                errors[i].heading, errors[i].what);
        header(f, r, "rule");
        for (int k = 0; k < NUM_ANCHOR_RULES; k++)
            bias_row(f, r, k, i);
        fputc('\n', f);
    }
}

static void page(FILE *f, const struct anchor_results *r)
{
    fprintf(
        f,
        "# Our gate and other renderers' tests on the same pictures\n\n"
        "Made by `make anchors`, which measures [results.json](results.json) first (Assay %s, %s). "
        "`tests/studies/anchors/test_anchors.c` checks that\nthis page is what the record and the settings "
        "give.\n\n"
        "![Smallest global bias found](global.svg)\n\n"
        "![Smallest bias of bounced light found](bounced.svg)\n\n"
        "![Smallest bias of a region found](region.svg)\n\n",
        r->version, r->date);
    if (r->num_scenes < NUM_ANCHOR_SCENES)
        fprintf(f, "**Incomplete: %d of %d scenes.** `make anchors` measures all.\n\n",
                r->num_scenes, NUM_ANCHOR_SCENES);
    claims(f, r);
    method(f, r);
    tables(f, r);
    reading(f, r);
}

bool anchors_write_page(const char *dir, const struct anchor_results *r, struct err *e)
{
    struct out_file o;
    for (int i = 0; i < NUM_ANCHOR_ERRORS; i++)
        if (!anchors_write_plot(fs_path("%s/%s.svg", dir, anchor_error_id[i]).s, r, i,
                                errors[i].plot, e))
            return false;
    if (!out_open(&o, fs_path("%s/README.md", dir).s, e))
        return false;
    page(o.f, r);
    return out_commit(&o, e);
}
