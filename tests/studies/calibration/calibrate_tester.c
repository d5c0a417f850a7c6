#include "calibrate_tester.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *const weakness_name[NUM_WEAKNESSES] = {
    "as it is",
    "ten times alpha",
    "a tenth of alpha",
    "observations copied",
    "variance of B left out",
    "third moments left out",
};
const char *const column_name[NUM_COLUMNS] = {
    "image", "pyramid", "dense", "directed", "noise", "gate", "mean alone", "tile alone",
};

static bool run(const struct moments *a, const struct moments *b, const struct compare_options *opt,
                struct outcome *out, struct err *e)
{
    struct comparison c;
    if (!compare_moments(a, b, opt, &c, e))
        return false;
    *out = (struct outcome){.verdict = c.verdict,
                            .mean = c.global[3],
                            .worst_tile = c.worst_tile,
                            .mdb_global = c.mdb_global,
                            .mdb_tile = c.mdb_tile};
    double gate = 1;
    for (int s = 0; s < NUM_STATISTICS; s++) {
        const struct statistic *st = &c.statistic[s];
        bool tested = st->share > 0 && st->num_tests > 0;
        out->log10_p[s] = tested ? st->log10_p : 1;
        if (tested)
            gate = fmin(fmin(gate, 0), st->log10_p - log10(st->share));
    }
    out->log10_p[COLUMN_GATE] = gate;
    /* Without a limit of detection it was too skewed to be tested. */
    out->log10_p[COLUMN_MEAN] = c.global[3].mdb < 1e6 ? c.global[3].log10_p : 1;
    out->log10_p[COLUMN_TILE] = c.tile_log10_p[0];
    comparison_free(&c);
    return true;
}

static void weaken(enum weakness weakness, struct moments *m, bool is_b)
{
    size_t pixels = (size_t)m->width * (size_t)m->height;
    bool exact = strcmp(m->unit, "exact") == 0;
    for (size_t i = 0; i < 3 * pixels; i++) {
        if (weakness == WEAK_COPIED && !exact) {
            m->m2[i] *= 2;
            m->m3[i] *= 2;
            if (i % 3 == 0)
                m->n[i / 3] *= 2;
        } else if (weakness == WEAK_ONE_SIDED && is_b) {
            m->m2[i] = m->m3[i] = 0;
        } else if (weakness == WEAK_NO_SKEW) {
            m->m3[i] = 0;
        }
    }
    if (weakness == WEAK_ONE_SIDED && is_b)
        snprintf(m->unit, sizeof m->unit, "exact");
}

/* The verdict and p-values of a tester that uses 10^shift alpha in place of the alpha asked for. */
static bool run_shifted(const struct moments *a, const struct moments *b,
                        const struct compare_options *opt, double shift, struct outcome *out,
                        struct err *e)
{
    struct compare_options other = *opt;
    other.alpha *= pow(10, shift);
    if (!run(a, b, &other, out, e))
        return false;
    for (int c = 0; c < NUM_COLUMNS; c++)
        out->log10_p[c] = out->log10_p[c] > 0 ? 1 : out->log10_p[c] - shift;
    return true;
}

bool tester_run(enum weakness weakness, const struct moments *a, const struct moments *b,
                const struct compare_options *opt, struct outcome *out, struct err *e)
{
    if (weakness == WEAK_NOT)
        return run(a, b, opt, out, e);
    if (weakness == WEAK_LENIENT)
        return run_shifted(a, b, opt, 1, out, e);
    if (weakness == WEAK_STRICT) {
        struct outcome honest;
        if (!run(a, b, opt, &honest, e) || !run_shifted(a, b, opt, -1, out, e))
            return false;
        out->mdb_global = honest.mdb_global;
        out->mdb_tile = honest.mdb_tile;
        return true;
    }
    struct moments wa = {0}, wb = {0};
    bool ok = moments_copy(a, &wa, e) && moments_copy(b, &wb, e);
    if (ok) {
        weaken(weakness, &wa, false);
        weaken(weakness, &wb, true);
        ok = run(&wa, &wb, opt, out, e);
    }
    moments_free(&wa);
    moments_free(&wb);
    return ok;
}
