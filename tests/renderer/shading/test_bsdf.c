/* BSDF tests: samples, density and value must agree with each other, and with the textbook formulas
 * (GGX, Beckmann, Fresnel) in double precision of tests/support/optics.h. One seed, fixed n, no
 * retry.
 *
 * The statistical tests run over the table {diffuse; GGX, Beckmann x alpha .02 .1 .3 .7 1; three plastics} x
 * {wo at 0, 30, 60, 80, 87 degrees}. H0: directions have the density bsdf_pdf_w() (chi-square over 80
 * patches and the samples that leave below the surface, patches that expect fewer than 10 pooled);
 * the samples lost below the surface have the chance that the density leaves (z); the mean weight is
 * the integral of f cos (z). Alpha 1e-4 for the whole file, Bonferroni over TESTS. n = 40000: a
 * roughness off by 15 % has a noncentrality of several hundred, power 1 - 1e-9. It is the negative
 * control in every row of metals; for plastics kd and ks exchanged, for diffuse the uniform density. */
#include "bsdf.h"

#include "renderer/shading/fresnel.h"
#include "renderer/shading/microfacet.h"
#include "renderer/math/sampler.h"
#include "tests/support/optics.h"
#include "tests/support/test.h"

#include <gsl/gsl_cdf.h>

enum {
    SAMPLES = 40000,
    TAUS = 10,
    PSIS = 8,
    PATCHES = TAUS * PSIS,
    ANGLES = 5,
    ROUGH = 5,
    PLASTICS = 3
};
enum { SPECS = 1 + 2 * ROUGH + PLASTICS, ROWS = SPECS * ANGLES, TESTS = 3 * ROWS };

static const uint64_t SEED = 20260203;
static const double ALPHA = 1e-4 / TESTS;
static const double AZIMUTH = 0.7, DEGREE = M_PI / 180;
static const double angle[ANGLES] = {0, 30, 60, 80, 87};
static const double roughness[ROUGH] = {0.02, 0.1, 0.3, 0.7, 1};

static struct material metal(enum microfacet_kind kind, double alpha)
{
    return (struct material){.kind = MATERIAL_MICROFACET,
                             .microfacet = kind,
                             .alpha = (float)alpha,
                             .reflectance = grey(1)};
}

static struct material plastic(double diffuse, double specular, double mirror, double alpha)
{
    return (struct material){.kind = MATERIAL_PLASTIC,
                             .microfacet = MICROFACET_BECKMANN,
                             .separable = true,
                             .alpha = (float)alpha,
                             .reflectance = grey((float)diffuse),
                             .specular = grey((float)specular),
                             .mirror = grey((float)mirror)};
}

static struct material spec(int i)
{
    static const double of_plastic[PLASTICS][3] = {{.3, .6, .1}, {.6, .25, .5}, {.7, .2, .05}};
    if (i > 2 * ROUGH) {
        const double *p = of_plastic[i - 1 - 2 * ROUGH];
        return plastic(p[0], p[1], 0, p[2]);
    }
    if (i == 0)
        return (struct material){.kind = MATERIAL_DIFFUSE, .reflectance = grey(1), .alpha = 1};
    return metal(i <= ROUGH ? MICROFACET_GGX : MICROFACET_BECKMANN, roughness[(i - 1) % ROUGH]);
}

static const char *name_of(const struct material *m)
{
    return m->kind == MATERIAL_DIFFUSE       ? "diffuse"
           : m->kind == MATERIAL_PLASTIC     ? "plastic"
           : m->microfacet == MICROFACET_GGX ? "GGX"
                                             : "Beckmann";
}

static vec3 to_float(const double w[3])
{
    return v3((float)w[0], (float)w[1], (float)w[2]);
}

static struct optics_patch patch(int i)
{
    int t = i / PSIS, p = i % PSIS;
    return (struct optics_patch){t / (double)TAUS, (t + 1) / (double)TAUS, 2 * M_PI * p / PSIS,
                                 2 * M_PI * (p + 1) / PSIS};
}

struct pair {
    const struct material *m;
    vec3 wo;
};

static double density(const double wi[3], void *data)
{
    const struct pair *p = data;
    return (double)bsdf_pdf_w(p->m, p->wo, to_float(wi));
}

static double uniform_density(const double wi[3], void *data)
{
    (void)wi;
    (void)data;
    return 1 / (2 * M_PI);
}

static double f_cos(const double wi[3], void *data)
{
    const struct pair *p = data;
    return (double)bsdf_eval(p->m, p->wo, to_float(wi)).g * wi[2];
}

/* Integral of g over each patch, and in the last place 1 minus their sum. */
static void shares(const struct optics_view *v, double (*g)(const double wi[3], void *),
                   struct pair *pair, double share[PATCHES + 1])
{
    double sum = 0;
    for (int i = 0; i < PATCHES; i++) {
        struct optics_patch p = patch(i);
        share[i] = optics_integrate_directions(v, &p, g, pair);
        sum += share[i];
    }
    share[PATCHES] = 1 - sum;
}

/* p-value of Pearson's chi-square; bins with fewer than 10 expected are pooled, and the pool joins the
 * fullest bin if it still expects fewer than 10. */
static double chi_square_tail(const int count[PATCHES + 1], const double share[PATCHES + 1])
{
    double x = 0, rest = 0, fullest = 0, fullest_count = 0;
    int places = 0, rest_count = 0;
    for (int i = 0; i <= PATCHES; i++) {
        double expected = SAMPLES * share[i];
        if (expected < 10) {
            rest += expected;
            rest_count += count[i];
        } else if (expected > fullest) {
            if (fullest > 0)
                x += (fullest_count - fullest) * (fullest_count - fullest) / fullest, places++;
            fullest = expected;
            fullest_count = count[i];
        } else {
            x += (count[i] - expected) * (count[i] - expected) / expected;
            places++;
        }
    }
    if (rest >= 10) {
        x += (rest_count - rest) * (rest_count - rest) / rest;
        places++;
    } else {
        fullest += rest;
        fullest_count += rest_count;
    }
    x += (fullest_count - fullest) * (fullest_count - fullest) / fullest;
    return gsl_cdf_chisq_Q(x, places);
}

struct drawn {
    int count[PATCHES + 1];
    double mean, std_error; /* of the weight */
};

/* Every sample is also checked against value and density: weight = f cos / pdf_w. */
static struct drawn draw(const struct material *m, const struct optics_view *v, uint32_t row)
{
    struct drawn d = {0};
    vec3 wo = to_float(v->wo);
    double sum = 0, sum2 = 0;
    for (uint32_t i = 0; i < SAMPLES; i++) {
        struct sample4 u = sampler_get(SEED, row, i, 1, PURPOSE_BSDF);
        struct bsdf_sample s = bsdf_sample_direction(m, true, wo, u.u[0], u.u[1], u.u[2]);
        if (s.pdf_w <= 0) {
            d.count[PATCHES]++;
            continue;
        }
        assert_false(s.delta);
        assert_true(s.eta2 == 1 && s.wi.z > 0 && fabsf(length(s.wi) - 1) < 1e-5f);
        double pdf_w = (double)bsdf_pdf_w(m, wo, s.wi), w = (double)s.weight.g;
        double ratio = (double)bsdf_eval(m, wo, s.wi).g * (double)s.wi.z / pdf_w;
        if (!(fabs(ratio - w) <= 1e-5 + 1e-4 * w) || (double)s.pdf_w != pdf_w)
            fail_msg("%s %g: weight %g, f cos/pdf %g; pdf %g, %g", name_of(m), (double)m->alpha, w,
                     ratio, (double)s.pdf_w, pdf_w);
        double wi[3] = {(double)s.wi.x, (double)s.wi.y, (double)s.wi.z}, tau, psi;
        optics_patch_of(v, wi, &tau, &psi);
        int t = (int)(tau * TAUS), p = (int)(psi / (2 * M_PI) * PSIS);
        d.count[(t < TAUS ? t : TAUS - 1) * PSIS + (p < PSIS ? p : PSIS - 1)]++;
        sum += w;
        sum2 += w * w;
    }
    d.mean = sum / SAMPLES;
    d.std_error = sqrt(fmax(0, sum2 / SAMPLES - d.mean * d.mean) / SAMPLES);
    return d;
}

static void check_row(int i, int a)
{
    struct material m = spec(i);
    struct optics_view v = optics_view(cos(angle[a] * DEGREE), AZIMUTH, (double)m.alpha);
    struct pair pair = {&m, to_float(v.wo)};
    double z = gsl_cdf_ugaussian_Qinv(ALPHA / 2), share[PATCHES + 1], other[PATCHES + 1];
    struct drawn d = draw(&m, &v, (uint32_t)(i * ANGLES + a));
    shares(&v, density, &pair, share);

    double lost = share[PATCHES];
    if (lost < -1e-4)
        fail_msg("%s %g at %g: pdf_w integrates to %.7g", name_of(&m), (double)m.alpha, angle[a],
                 1 - lost);
    share[PATCHES] = lost = fmax(0, lost);
    double lost_error = fabs(d.count[PATCHES] - SAMPLES * lost);
    if (lost_error > z * sqrt(SAMPLES * lost * (1 - lost)) + 1e-4 * SAMPLES)
        fail_msg("%s %g at %g: %d samples below the surface, %.1f expected", name_of(&m),
                 (double)m.alpha, angle[a], d.count[PATCHES], SAMPLES * lost);

    double p = chi_square_tail(d.count, share);
    if (p < ALPHA)
        fail_msg("%s %g at %g: chi-square has p = %.3g", name_of(&m), (double)m.alpha, angle[a], p);
    struct material rougher = m;
    if (m.kind == MATERIAL_PLASTIC) {
        rougher.reflectance = m.specular;
        rougher.specular = m.reflectance;
    } else {
        rougher.alpha *= 1.15f;
    }
    struct pair control = {&rougher, pair.wo};
    shares(&v, m.kind == MATERIAL_DIFFUSE ? uniform_density : density, &control, other);
    other[PATCHES] = fmax(0, other[PATCHES]);
    if (chi_square_tail(d.count, other) >= ALPHA)
        fail_msg("%s %g at %g: the negative control passes", name_of(&m), (double)m.alpha,
                 angle[a]);

    shares(&v, f_cos, &pair, share);
    double albedo = 1 - share[PATCHES];
    if (albedo > 1 + 1e-4 || fabs(d.mean - albedo) > z * d.std_error + 1e-4)
        fail_msg("%s %g at %g: albedo %.6g by samples, %.6g by quadrature", name_of(&m),
                 (double)m.alpha, angle[a], d.mean, albedo);
    if (fabs(d.mean - 1.05 * albedo) <= z * d.std_error + 1e-4)
        fail_msg("%s %g at %g: an albedo off by 5 %% passes", name_of(&m), (double)m.alpha,
                 angle[a]);
}

/* GGX of roughness 1 is D = 1/pi. Seen from above G2 is G1(wi) = 2c/(1 + c), c = cos(theta_i), and the
 * albedo is the integral of G1/(4 pi) over directions, of c/(1 + c) over c: 1 - ln 2. */
TEST(albedo_in_closed_form)
{
    for (int separable = 0; separable < 2; separable++) {
        struct material m = metal(MICROFACET_GGX, 1);
        m.separable = separable;
        struct optics_view v = optics_view(1, AZIMUTH, 1);
        struct pair pair = {&m, to_float(v.wo)};
        double share[PATCHES + 1];
        shares(&v, f_cos, &pair, share);
        assert_true(fabs(1 - share[PATCHES] - (1 - log(2))) < 1e-5);
        struct optics_metal same = {.ggx = true, .separable = separable, .alpha = 1};
        assert_true(fabs(optics_metal_albedo(&same, 1) - (1 - log(2))) < 1e-5);
        /* Negative control. */
        same.ggx = false;
        assert_true(fabs(optics_metal_albedo(&same, 1) - (1 - log(2))) > 0.1);
    }
}

TEST(samples_have_their_density)
{
    for (int i = 0; i < SPECS; i++)
        for (int a = 0; a < ANGLES; a++)
            check_row(i, a);
}

/* f against the double precision formulas, which also tie down both ways of shadowing and the
 * conductor's Fresnel factor; f(wo, wi) = f(wi, wo). Float32 resolves a normal to 6e-8, that is 3e-6
 * of alpha = .02, and D is at most of the power 4 in it (GGX) or of exponent 2 tan^2/alpha^2
 * (Beckmann, below 40 where f is not negligible). */
TEST(values_and_reciprocity)
{
    const double complex n[3] = {0.2 + 3.9 * _Complex_I, 0.92 + 2.45 * _Complex_I,
                                 1.1 + 1.8 * _Complex_I};
    for (uint32_t i = 0; i < 20000; i++) {
        struct sample4 u = sampler_get(SEED, 1000, i, 1, 0), k = sampler_get(SEED, 1000, i, 1, 1);
        struct optics_metal s = {.ggx = k.u[0] < 0.5f,
                                 .separable = k.u[1] < 0.5f,
                                 .alpha = roughness[(int)(k.u[2] * ROUGH)]};
        struct material m = metal(s.ggx ? MICROFACET_GGX : MICROFACET_BECKMANN, s.alpha);
        m.separable = s.separable;
        m.conductor = k.u[3] < 0.5f;
        m.eta = (rgb){0.2f, 0.92f, 1.1f};
        m.k = (rgb){3.9f, 2.45f, 1.8f};
        vec3 wo = normalize(v3(2 * u.u[0] - 1, 2 * u.u[1] - 1, 0.02f + u.u[2]));
        struct bsdf_sample sample = bsdf_sample_direction(&m, true, wo, u.u[3], k.u[3], 0);
        if (sample.pdf_w <= 0)
            continue;
        vec3 wi = normalize(sample.wi);
        rgb there = bsdf_eval(&m, wo, wi), back = bsdf_eval(&m, wi, wo);
        const float value[3] = {there.r, there.g, there.b}, other[3] = {back.r, back.g, back.b};
        double o[3] = {(double)wo.x, (double)wo.y, (double)wo.z};
        double in[3] = {(double)wi.x, (double)wi.y, (double)wi.z};
        for (int c = 0; c < 3; c++) {
            s.n = m.conductor ? n[c] : 0;
            double expected = optics_metal_f_cos(&s, o, in) / in[2];
            if (!(fabs((double)value[c] - expected) <= 1e-3 * expected + 1e-6))
                fail_msg("%s %g: f %.7g, expected %.7g", name_of(&m), s.alpha, (double)value[c],
                         expected);
            if (!(fabsf(value[c] - other[c]) <= 1e-4f * value[c] + 1e-7f))
                fail_msg("%s %g: f %.7g there, %.7g back", name_of(&m), s.alpha, (double)value[c],
                         (double)other[c]);
            /* Negative control: the other way of shadowing, where it differs. */
            s.separable = !s.separable;
            double wrong = optics_metal_f_cos(&s, o, in) / in[2];
            s.separable = !s.separable;
            assert_true(fabs(wrong - expected) <= 2e-3 * expected + 2e-6 ||
                        fabs((double)value[c] - wrong) > 1e-3 * wrong + 1e-6);
        }
    }
}

/* f = kd/pi + ks D G / (4 cos cos); lobes are chosen in proportion to the largest channels of kd, ks and
 * kr; a mirror sample has the weight kr over the probability of the mirror lobe. */
TEST(plastic_is_the_sum_of_its_lobes)
{
    int told = 0, rounds = 5000;
    for (uint32_t i = 0; i < (uint32_t)rounds; i++) {
        struct sample4 u = sampler_get(SEED, 1001, i, 1, 0), k = sampler_get(SEED, 1001, i, 1, 1),
                       w = sampler_get(SEED, 1001, i, 1, 2);
        const double alpha = roughness[1 + (int)(k.u[3] * (ROUGH - 1))];
        struct material m = plastic(0, 0, 0, alpha), facets = metal(MICROFACET_BECKMANN, alpha);
        m.reflectance = (rgb){0.1f, 0.5f * k.u[0], 0.3f};
        m.specular = (rgb){0.4f * k.u[1], 0.1f, 0.2f};
        m.mirror = (rgb){0.1f, 0.2f, 0.1f + 0.2f * k.u[2]};
        facets.separable = true;
        const double kd = fmax(0.3, (double)m.reflectance.g), ks = fmax(0.2, (double)m.specular.r),
                     kr = fmax(0.2, (double)m.mirror.b), all = kd + ks + kr;
        vec3 wo = normalize(v3(2 * u.u[0] - 1, 2 * u.u[1] - 1, 0.02f + u.u[2]));
        vec3 wi = normalize(v3(2 * w.u[0] - 1, 2 * w.u[1] - 1, 0.02f + w.u[2]));
        const double o[3] = {(double)wo.x, (double)wo.y, (double)wo.z};
        const double in[3] = {(double)wi.x, (double)wi.y, (double)wi.z};
        const struct optics_metal rough = {.separable = true, .alpha = alpha};
        const double lobe = optics_metal_f_cos(&rough, o, in) / in[2];
        rgb f = bsdf_eval(&m, wo, wi), back = bsdf_eval(&m, wi, wo);
        const double expected = (double)m.reflectance.g / M_PI + (double)m.specular.g * lobe;
        assert_near(f.g, expected, 1e-3 * expected + 1e-6);
        assert_near(f.r, (double)m.reflectance.r / M_PI + (double)m.specular.r * lobe,
                    1e-3 * (double)f.r + 1e-6);
        assert_true(fabsf(f.b - back.b) <= 1e-4f * f.b + 1e-7f);
        const double of_facets = (double)bsdf_pdf_w(&facets, wo, wi),
                     pdf_w = (double)bsdf_pdf_w(&m, wo, wi);
        const double mixed = kd / all * in[2] / M_PI + ks / all * of_facets;
        assert_near(pdf_w, mixed, 1e-5 * mixed + 1e-7);
        /* Negative control: lobes that are picked by even chances. */
        const double even = (in[2] / M_PI + of_facets) / 3;
        told += fabs(pdf_w - even) > 0.01 * even;
        struct bsdf_sample s =
            bsdf_sample_direction(&m, true, wo, w.u[0], w.u[1], (float)(kr / all - 1e-5));
        assert_true(s.delta && s.pdf_w == 1 && s.wi.x == -wo.x && s.wi.z == wo.z);
        assert_near(s.weight.g, (double)m.mirror.g / (kr / all), 1e-5);
        s = bsdf_sample_direction(&m, true, wo, w.u[0], w.u[1], (float)(kr / all + 1e-5));
        assert_true(!s.delta);
        s = bsdf_sample_direction(&m, true, wo, w.u[0], w.u[1], 1 - 0x1p-24f);
        const vec3 cosine = warp_cosine_hemisphere(w.u[0], w.u[1]);
        assert_true(!s.delta && s.wi.x == cosine.x && s.wi.z == cosine.z && s.pdf_w > 0);
        /* No weight is above all lobes together. */
        assert_true((double)rgb_max(s.weight) <= all * 1.0001);
    }
    assert_true(told > rounds * 9 / 10);
    assert_true(!bsdf_is_delta(&(struct material){.kind = MATERIAL_PLASTIC}));
}

struct facet {
    enum microfacet_kind kind;
    double alpha;
    const double *wo;
    double g1; /* negative: without masking */
};

static double facets(const double m[3], void *data)
{
    const struct facet *f = data;
    double d = (double)microfacet_d(f->kind, (float)f->alpha, to_float(m));
    if (f->g1 < 0)
        return d * m[2];
    return f->g1 * d * (m[0] * f->wo[0] + m[1] * f->wo[1] + m[2] * f->wo[2]);
}

static double over_all(const struct optics_view *v, struct facet *f)
{
    double sum = 0;
    for (int k = 0; k < 8; k++) {
        struct optics_patch p = {k / 8.0, (k + 1) / 8.0, 0, M_PI};
        sum += 2 * optics_integrate_normals(v, false, &p, facets, f);
    }
    return sum;
}

/* The starter code's Lambda, with pi where sqrt(pi) belongs; a = 1/(alpha tan(theta_o)). */
static double lambda_of_the_assignment(double alpha, double cos_o)
{
    double a = cos_o / (alpha * sqrt(1 - cos_o * cos_o));
    return 0.5 * (exp(-a * a) / (a * M_PI) - erfc(a));
}

/* The projected area of all facets on a unit of surface is 1 [Heitz14 eq. 7]; that of the facets visible
 * from wo, projected towards wo, is cos_o [Heitz14 eq. 14]. */
TEST(facets_cover_the_surface)
{
    for (int kind = 0; kind < 2; kind++)
        for (int r = 0; r < ROUGH; r++) {
            struct facet f = {(enum microfacet_kind)kind, roughness[r], NULL, -1};
            struct optics_view above = optics_view(1, 0, f.alpha);
            double all = over_all(&above, &f);
            if (fabs(all - 1) > 1e-4)
                fail_msg("kind %d alpha %g: D covers %.7g", kind, f.alpha, all);
            for (int a = 0; a < ANGLES; a++) {
                struct optics_view v = optics_view(cos(angle[a] * DEGREE), 0, f.alpha);
                f.wo = v.wo;
                f.g1 = 1 / (1 + (double)microfacet_lambda(f.kind, (float)f.alpha, to_float(v.wo)));
                double seen = over_all(&v, &f);
                if (fabs(seen / v.cos_o - 1) > 3e-4 || f.g1 > 1.000001)
                    fail_msg("kind %d alpha %g at %g: %.7g of the surface is seen, G1 %.7g", kind,
                             f.alpha, angle[a], seen / v.cos_o, f.g1);
                f.g1 = -1;
            }
        }
    /* Negative control: the assignment's masking, alpha .5 at 70 degrees, has G1 > 1. */
    struct optics_view v = optics_view(cos(70 * DEGREE), 0, 0.5);
    double defect = 1 / (1 + lambda_of_the_assignment(0.5, v.cos_o));
    struct facet f = {MICROFACET_BECKMANN, 0.5, v.wo, defect};
    assert_true(defect > 1.01);
    assert_true(fabs(over_all(&v, &f) / v.cos_o - 1) > 3e-2);
}

/* --starter: the starter code's shadowing with that Lambda, G = 1/(1 + Lambda(wo) + Lambda(wi)), in double. */
TEST(starter_code_shadows_as_its_header_says)
{
    for (int i = 0; i < ANGLES; i++)
        for (int o = 0; o < ANGLES; o++) {
            double ci = cos(angle[i] * DEGREE), co = cos(angle[o] * DEGREE);
            if (ci > 0.9999 || co > 0.9999)
                continue; /* lambda is 0 there, or 0/0 */
            vec3 wi = v3((float)sqrt(1 - ci * ci), 0, (float)ci),
                 wo = v3(0, (float)sqrt(1 - co * co), (float)co);
            double g = (double)microfacet_g2(MICROFACET_BECKMANN_STARTER, 0.5f, false, wo, wi);
            double text =
                1 / (1 + lambda_of_the_assignment(0.5, co) + lambda_of_the_assignment(0.5, ci));
            assert_true(fabs(g / text - 1) < 1e-4);
            double right = (double)microfacet_g2(MICROFACET_BECKMANN, 0.5f, false, wo, wi);
            if (angle[i] > 60 || angle[o] > 60)
                assert_true(g > right * 1.02);
        }
}

/* Every corner of what the sampler can return, down to directions in the surface itself. */
TEST(nothing_becomes_nan)
{
    static const float edge[] = {0, 0x1p-24f, 0.25f, 0.5f, 0.75f, 1 - 0x1p-24f};
    static const float height[] = {1, 0.1f, 1e-3f, 1e-7f, 1e-12f, 1e-20f, 1e-38f, 1e-45f};
    static const float alpha[] = {MICROFACET_MIN_ALPHA, 1e-3f, 0.3f, 10};
    static const rgb eta[] = {{0, 1, 1}, {1, 0.05f, 1000}}, k[] = {{0, 0, 1e-3f}, {0, 4, 1000}};
    enum { EDGES = sizeof edge / sizeof *edge, HEIGHTS = sizeof height / sizeof *height };
    for (int i = 0; i < 16 * 3 * HEIGHTS * EDGES * EDGES; i++) {
        int u = i % EDGES, v = i / EDGES % EDGES, rest = i / (EDGES * EDGES);
        float z = height[rest % HEIGHTS];
        int which = rest / HEIGHTS % 16, fresnel = rest / HEIGHTS / 16;
        struct material m =
            metal(which % 2 ? MICROFACET_GGX : MICROFACET_BECKMANN, (double)alpha[which / 4]);
        m.separable = which / 2 % 2;
        m.conductor = fresnel > 0;
        m.eta = eta[fresnel % 2];
        m.k = k[fresnel % 2];
        float across = sqrtf(1 - z * z);
        vec3 wo = v3(0.6f * across, -0.8f * across, z);
        struct bsdf_sample s = bsdf_sample_direction(&m, true, wo, edge[u], edge[v], 0);
        if (!isfinite(s.pdf_w) || s.pdf_w < 0)
            fail_msg("%s %g: pdf_w %g", name_of(&m), (double)m.alpha, (double)s.pdf_w);
        if (s.pdf_w > 0 &&
            (!(rgb_max(s.weight) <= 1.0001f) || !(s.weight.r >= 0 && s.weight.g >= 0) ||
             !(s.weight.b >= 0) || !(fabsf(length(s.wi) - 1) < 1e-4f)))
            fail_msg("%s %g, wo.z %g: weight %g %g %g, length %g", name_of(&m), (double)m.alpha,
                     (double)z, (double)s.weight.r, (double)s.weight.g, (double)s.weight.b,
                     (double)length(s.wi));
        /* Straight back, forwards over the surface, and what was sampled. */
        const vec3 wi[] = {wo, v3(-wo.x, -wo.y, z), v3(0, 0, 1), v3(0.8f, 0.6f, 1e-20f), s.wi};
        for (size_t w = 0; w < sizeof wi / sizeof *wi; w++) {
            rgb f = bsdf_eval(&m, wo, wi[w]);
            float pdf_w = bsdf_pdf_w(&m, wo, wi[w]);
            if (!(isfinite(f.r) && isfinite(f.g) && isfinite(f.b) && isfinite(pdf_w)) || f.r < 0 ||
                f.g < 0 || f.b < 0 || pdf_w < 0)
                fail_msg("%s %g, wo.z %g, wi %zu: f %g %g %g, pdf_w %g", name_of(&m),
                         (double)m.alpha, (double)z, w, (double)f.r, (double)f.g, (double)f.b,
                         (double)pdf_w);
        }
    }
}

/* A cosine is known only to a few float steps, which dominates the error near the critical angle, where the
 * slope of R is infinite. */
static bool near_fresnel(double got, double cos_i, double complex n)
{
    double low = optics_fresnel(fmax(0, cos_i * (1 - 3e-7)), n);
    double high = optics_fresnel(fmin(1, cos_i * (1 + 3e-7)), n);
    return fabs(got - optics_fresnel(cos_i, n)) <= 1e-5 + fabs(high - low);
}

static float cosine_step(int i)
{
    return i == 0 ? 1e-6f : (float)sin(i * M_PI / 2000);
}

TEST(dielectric_by_complex_amplitudes)
{
    static const double index[] = {0.1,    0.5,   1 / 1.5, 0.9,  0.999, 1 / 1.0003, 1,
                                   1.0003, 1.001, 1.1,     1.33, 1.5,   2.42,       10};
    for (size_t j = 0; j < sizeof index / sizeof *index; j++)
        for (int i = 0; i <= 1000; i++) {
            float cos_i = cosine_step(i), cos_t;
            double n = (double)(float)index[j], c = (double)cos_i;
            double r = (double)fresnel_dielectric(cos_i, (float)index[j], &cos_t);
            if (!near_fresnel(r, c, n))
                fail_msg("n %g, cos %.9g: R %.7g, expected %.7g", n, c, r, optics_fresnel(c, n));
            /* Snell's law: both sines in proportion. */
            if (cos_t > 0)
                assert_true(fabs(n * n * (1 - (double)cos_t * (double)cos_t) - (1 - c * c)) <
                            1e-6 * fmax(1, n * n));
            else
                assert_true(r == 1 && (1 - c * c) / (n * n) > 1 - 1e-6);
        }
    /* Negative control: one polarisation alone. */
    double s = pow((cos(1) - 1.5 * sqrt(1 - pow(sin(1) / 1.5, 2))) /
                       (cos(1) + 1.5 * sqrt(1 - pow(sin(1) / 1.5, 2))),
                   2);
    assert_false(near_fresnel(s, cos(1), 1.5));
}

/* Normal incidence: ((n-1)/(n+1))^2. Brewster's angle, tan = n: nothing of the parallel part and, with
 * cos_i = 1/sqrt(1+n^2) and cos_t = n cos_i, half of ((n^2-1)/(n^2+1))^2. Beyond sin = n < 1: all.
 * Stokes: what is reflected and what is transmitted is everything, and the reflectance from behind
 * at the refracted angle is that from in front. */
TEST(dielectric_in_closed_form)
{
    static const double index[] = {1.1, 1.33, 1.5, 2.42, 1 / 1.1, 1 / 1.5, 0.3};
    for (size_t j = 0; j < sizeof index / sizeof *index; j++) {
        double n = index[j], b = 1 / sqrt(1 + n * n), even = pow((n - 1) / (n + 1), 2);
        double brewster = pow((n * n - 1) / (n * n + 1), 2) / 2;
        float cos_t, back_t;
        assert_true(fabs((double)fresnel_dielectric(1, (float)n, &cos_t) - even) < 1e-6);
        assert_true(fabsf(cos_t - 1) < 1e-6f);
        assert_true(fabs((double)fresnel_dielectric((float)b, (float)n, &cos_t) - brewster) < 1e-5);
        assert_true(fabs((double)cos_t - n * b) < 1e-6);
        for (int i = 1; i <= 1000; i++) {
            float cos_i = cosine_step(i);
            double c = (double)cos_i, sine = sqrt(1 - c * c);
            float r = fresnel_dielectric(cos_i, (float)n, &cos_t);
            if (sine > n * 1.00001) {
                assert_true(r == 1 && cos_t == 0);
                continue;
            }
            if (sine > n * 0.999)
                continue;
            assert_true(fabs((double)r + optics_transmitted(c, n) - 1) < 2e-5);
            /* At more grazing angles the rounding of cos_t is amplified too much in cos_i. */
            if (c < 0.1)
                continue;
            float back = fresnel_dielectric(cos_t, (float)(1 / n), &back_t);
            assert_true(fabsf(back - r) < 5e-5f && fabsf(back_t - cos_i) < 1e-5f);
        }
    }
    /* Negative control: the same angle from behind is another reflectance. */
    float t;
    assert_true(fabsf(fresnel_dielectric(0.8f, 1.5f, &t) - fresnel_dielectric(0.8f, 1 / 1.5f, &t)) >
                1e-2f);
}

/* Schlick's curve meets the exact one at normal incidence and ends at 1; in between it is another. */
TEST(schlick_at_both_ends)
{
    static const float index[] = {1.1f, 1.45f, 2.42f, 1 / 1.45f};
    for (size_t j = 0; j < sizeof index / sizeof *index; j++) {
        float t, u;
        assert_true(fabsf(fresnel_schlick(1, index[j], &t) - fresnel_dielectric(1, index[j], &u)) <
                    1e-6f);
        assert_true(fabsf(t - 1) < 1e-6f && t == u);
        assert_true(fabsf(fresnel_schlick(1e-6f, index[j], &t) - 1) < 1e-4f);
    }
    float t;
    assert_true(fresnel_schlick(0.5f, 1 / 1.45f, &t) == 1 && t == 0);
    assert_true(fabsf(fresnel_schlick(0.5f, 1.45f, &t) - fresnel_dielectric(0.5f, 1.45f, &t)) >
                1e-3f);
}

TEST(conductor_by_complex_amplitudes)
{
    /* Metals, a poor one, a dielectric without absorption, none at all, and the loader's extremes. */
    static const double index[][2] = {
        {0.05, 4}, {0.2, 3.9}, {1.1, 1.8}, {2.9, 3.1},   {0.9, 0.02},  {1.5, 0},  {1, 0},
        {0.5, 0},  {1, 1e-3},  {0, 3},     {1000, 1000}, {0.01, 1000}, {1000, 0}, {1e-3, 1e-3}};
    for (size_t j = 0; j < sizeof index / sizeof *index; j++)
        for (int i = 0; i <= 1000; i++) {
            float cos_i = cosine_step(i), eta = (float)index[j][0], k = (float)index[j][1];
            double complex n = (double)eta + (double)k * _Complex_I;
            double r = (double)fresnel_conductor(cos_i, eta, k);
            if (!near_fresnel(r, (double)cos_i, n))
                fail_msg("n %g + i %g, cos %.9g: R %.7g, expected %.7g", (double)eta, (double)k,
                         (double)cos_i, r, optics_fresnel((double)cos_i, n));
        }
    assert_true(fresnel_conductor(1, 0, 0) == 1);
    /* Negative control: the assignment's approximation, which takes the index for large. */
    double c = 0.5, e = 1.1 * 1.1 + 1.8 * 1.8, m = 2 * 1.1 * c;
    double approx =
        0.5 * ((e - m + c * c) / (e + m + c * c) + (e * c * c - m + 1) / (e * c * c + m + 1));
    assert_false(near_fresnel(approx, c, 1.1 + 1.8 * _Complex_I));
}

/* Mirror and glass as functions: one or two directions, shares and weights. */
TEST(smooth_surfaces)
{
    struct material glass = {.kind = MATERIAL_GLASS,
                             .reflectance = {1, 0.5f, 0.25f},
                             .transmittance = {0.25f, 1, 0.5f},
                             .ior = 1.5f};
    vec3 wo = normalize(v3(0.3f, -0.4f, 0.6f));
    for (int front = 0; front < 2; front++) {
        double n = front ? 1.5 : 1 / 1.5, r = optics_fresnel((double)wo.z, n);
        struct bsdf_sample up = bsdf_sample_direction(&glass, front, wo, 0, 0, (float)r - 1e-4f);
        struct bsdf_sample down = bsdf_sample_direction(&glass, front, wo, 0, 0, (float)r + 1e-4f);
        assert_true(up.delta && up.pdf_w == 1 && up.eta2 == 1 && down.delta && down.pdf_w == 1);
        assert_true(up.wi.x == -wo.x && up.wi.y == -wo.y && up.wi.z == wo.z);
        assert_true(up.weight.r == 1 && up.weight.g == 0.5f && up.weight.b == 0.25f);
        assert_true(down.wi.z < 0 && fabsf(length(down.wi) - 1) < 1e-6f);
        assert_true(fabs((double)down.wi.x * n + (double)wo.x) < 1e-6 &&
                    fabs((double)down.wi.y * n + (double)wo.y) < 1e-6);
        assert_true(fabs((double)down.weight.g * n * n - 1) < 1e-6);
        assert_true(fabs((double)down.weight.r * n * n - 0.25) < 1e-6);
        assert_true(fabs((double)down.eta2 - n * n) < 1e-6);
        struct material refraction = glass;
        refraction.kind = MATERIAL_REFRACTION;
        struct bsdf_sample only = bsdf_sample_direction(&refraction, front, wo, 0, 0, 0);
        assert_true(only.wi.z == down.wi.z && only.weight.b == down.weight.b);
    }
    vec3 flat = normalize(v3(0.9f, 0, 0.3f));
    struct material refraction = glass;
    refraction.kind = MATERIAL_REFRACTION;
    assert_true(bsdf_sample_direction(&refraction, false, flat, 0, 0, 0).pdf_w == 0);
    /* Beyond the critical angle all is reflected, as much of each colour as ever. */
    struct bsdf_sample total = bsdf_sample_direction(&glass, false, flat, 0, 0, 1 - 0x1p-24f);
    assert_true(total.wi.x == -flat.x && total.wi.y == -flat.y && total.wi.z == flat.z);
    assert_true(total.delta && total.pdf_w == 1 && total.eta2 == 1);
    assert_true(total.weight.r == 1 && total.weight.g == 0.5f && total.weight.b == 0.25f);
    struct material mirror = {.kind = MATERIAL_MIRROR, .reflectance = {0.9f, 0.8f, 0.7f}};
    struct bsdf_sample s = bsdf_sample_direction(&mirror, false, wo, 0.3f, 0.4f, 0.5f);
    assert_true(s.delta && s.wi.x == -wo.x && s.wi.z == wo.z && s.weight.b == 0.7f);
    assert_true(bsdf_is_delta(&mirror) && bsdf_is_delta(&glass) && bsdf_is_delta(&refraction));
    assert_true(rgb_is_zero(bsdf_eval(&glass, wo, wo)) && bsdf_pdf_w(&mirror, wo, wo) == 0);
}
