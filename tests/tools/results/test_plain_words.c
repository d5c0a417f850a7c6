/* The sentences for claims made by hand; amounts are the claim's difference, rounded by hand. */
#include "tools/results/plain_words.h"
#include "tests/support/test.h"

/* Margins are 0.2 % of the image and 1 % of a tile; the worst tile and region are at 32,16. */
static json_t *claim_of(const char *verdict, const char *expected, double image, double tile,
                        double worst, int channel)
{
    json_t *c = json_pack(
        "{ss ss ss ss ss sb sf sf sf s[ff] s{sf sf sf sf sf s[ff]} s{sf sf sf sf si sf} sf sf}",
        "scene", "12_point_plane", "a", "mine", "b", "truth", "verdict", verdict, "expected",
        expected, "passed", strcmp(verdict, expected) == 0, "margin_global", 0.002, "margin_tile",
        0.01, "difference", image, "ci", image - 0.001, image + 0.001, "worst_tile", "x", 32., "y",
        16., "width", 16., "height", 16., "difference", tile, "ci", tile - 0.002, tile + 0.002,
        "worst", "x", 32., "y", 16., "width", 2., "height", 2., "channel", channel, "difference",
        worst, "extra_factor", 2.5, "mdb_global", 0.0123);
    assert_non_null(c);
    return c;
}

/* With a difference that is not noise, +-0.1 %, of the image of 64 x 48 pixels or of a tile in it. */
static json_t *with_significant(json_t *claim, double difference, bool is_tile, int channel)
{
    json_object_update_new(
        claim,
        json_pack("{sf sf sf s{sf sf sf sf si sf s[ff] sf}}", "tile", 16., "tiles_x", 4., "tiles_y",
                  3., "significant", "x", is_tile ? 32. : 0., "y", 0., "width", is_tile ? 16. : 64.,
                  "height", is_tile ? 16. : 48., "channel", channel, "difference", difference, "ci",
                  difference - 0.001, difference + 0.001, "margin", is_tile ? 0.01 : 0.002));
    return claim;
}

static void assert_says(json_t *claim, const char *sentence)
{
    assert_string_equal(plain_words_claim(claim).s, sentence);
    json_decref(claim);
}

TEST(who_how_much_and_where)
{
    assert_says(claim_of("DIFFERENT", "EQUIVALENT", 0.0101, 0.03, 0.5, 3),
                "mine is 1.0 % too bright on 12_point_plane (against truth)");
    assert_says(claim_of("DIFFERENT", "EQUIVALENT", -0.0042, 0.03, 0.5, 3),
                "mine is 0.42 % too dark on 12_point_plane (against truth)");
    assert_says(claim_of("DIFFERENT", "EQUIVALENT", 19, 0.03, 0.5, 3),
                "mine is 20 times as bright on 12_point_plane (against truth)");
    /* The image's interval reaches into the margin, the tile's does not. */
    assert_says(
        claim_of("DIFFERENT", "EQUIVALENT", 0.0025, -0.013, 0.5, 3),
        "mine is 1.3 % too dark in the 16 x 16 pixels at 32,16 on 12_point_plane (against truth)");
    assert_says(
        claim_of("DIFFERENT", "EQUIVALENT", 0, 0.011, 0.5, 0),
        "mine is 50.0 % too bright in red in the 2 x 2 pixels at 32,16 on 12_point_plane (against truth)");
    /* A region that is the image, of 64 x 48 pixels and 4 x 3 tiles, is no place. */
    json_t *all = claim_of("DIFFERENT", "EQUIVALENT", 0, 0, -0.033, 2), *most_of_it;
    json_object_update_new(all, json_pack("{si si si}", "tile", 16, "tiles_x", 4, "tiles_y", 3));
    json_object_update_new(
        json_object_get(all, "worst"),
        json_pack("{sf sf sf sf}", "x", 0., "y", 0., "width", 64., "height", 48.));
    most_of_it = json_deep_copy(all);
    json_object_set_new(json_object_get(most_of_it, "worst"), "height", json_real(32));
    assert_says(all, "mine is 3.3 % too dark in blue on 12_point_plane (against truth)");
    assert_says(most_of_it, "mine is 3.3 % too dark in blue in the 64 x 32 pixels at 0,0 on "
                            "12_point_plane (against truth)");
    assert_says(claim_of("EQUIVALENT", "DIFFERENT", 0, 0, 0, 3),
                "mine is the same on 12_point_plane (as truth), within 0.2 %");
    assert_says(
        claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3),
        "mine is too noisy to tell on 12_point_plane (against truth): about 2.5 times the samples would decide");
    /* The most that is said in numbers, and what nobody knows. */
    json_t *most = claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3),
           *unknown = json_deep_copy(most);
    json_object_set_new(most, "extra_factor", json_real(100));
    json_object_set_new(unknown, "extra_factor", json_real(1));
    assert_says(
        most,
        "mine is too noisy to tell on 12_point_plane (against truth): more than 100 times the samples "
        "would be needed: raise the margin or enlarge the tile");
    assert_says(unknown, "mine is too noisy to tell on 12_point_plane (against truth)");
    /* Not noise: neither is it said to be, nor is a larger margin called the way out. */
    json_t *near = with_significant(claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3), -0.00141,
                                    false, 2),
           *too_near = json_deep_copy(near);
    json_object_set_new(too_near, "extra_factor", json_real(100));
    assert_says(near,
                "mine is 0.14 % too dark in blue on 12_point_plane (against truth), which is "
                "not noise, but may be within the margin of 0.2 %: about 2.5 times the samples "
                "would decide");
    assert_says(too_near,
                "mine is 0.14 % too dark in blue on 12_point_plane (against truth), which "
                "is not noise, but may be within the margin of 0.2 %: more than 100 times "
                "the samples would be needed: choose another margin, as the difference is "
                "close to it");
    /* Something else is too noisy: what is not noise lies inside its margin. */
    assert_says(
        with_significant(claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3), 0.005, true, 3),
        "mine is too noisy to tell on 12_point_plane (against truth): about 2.5 times the "
        "samples would decide");
    assert_says(
        claim_of("NO DIFFERENCE FOUND", "EQUIVALENT", 0, 0, 0, 3),
        "no difference of mine was found on 12_point_plane (against truth); 1.23 % would have been");
}

TEST(how_noisy)
{
    json_auto_t *c = claim_of("DIFFERENT", "EQUIVALENT", 0, -0.001, 0.001, 3);
    json_object_update_new(c, json_pack("{sf s{sf s[ff]}}", "margin_variance", 0.3,
                                        "variance_ratio", "ratio", 1.9, "ci", 1.7, 2.1));
    assert_non_null(
        strstr(plain_words_claim(c).s, "mine is more noisy, 1.9 times the variance on"));
    json_object_update_new(
        c, json_pack("{s{sf s[ff]}}", "variance_ratio", "ratio", 0.5, "ci", 0.4, 0.6));
    assert_non_null(
        strstr(plain_words_claim(c).s, "mine is less noisy, 0.5 times the variance on"));
    assert_string_equal(plain_words_noise(c).s, "less noisy, 0.5 times the variance");
    json_object_set_new(c, "margin_variance", json_real(2));
    assert_string_equal(plain_words_noise(c).s, "");
    assert_null(strstr(plain_words_claim(c).s, "noisy"));
}

/* Variances that are too skewed to be compared have no interval. */
TEST(a_mean_that_is_decided_is_not_too_noisy_to_tell)
{
    json_auto_t *c = claim_of("INCONCLUSIVE", "EQUIVALENT", 0, -0.001, 0.001, 3);
    json_object_update_new(
        c, json_pack("{sf sf ss}", "margin_variance", 0.3, "extra_factor", 1., "reason",
                     "the variance could not be tested, being too skewed: it is about 2.75 times "
                     "that of B; mean: the image lies within 0.2 %"));
    assert_string_equal(
        plain_words_claim(c).s,
        "mine has the same mean on 12_point_plane (as truth), within 0.2 %, but the variance could "
        "not be tested, being too skewed: it is about 2.75 times that of B");
    json_object_set_new(c, "extra_factor", json_real(1.02));
    assert_string_equal(plain_words_claim(c).s,
                        "mine is too noisy to tell on 12_point_plane (against "
                        "truth): about 1.1 times the samples would decide");
}

/* extra_factor 2.5 is of both sides. Where a share s of the variance is that of A, A alone needs s/(1/2.5 - (1 - s)) times
 * its samples: 3 for s = 0.9. Where it needs more than twice as many as
 * it would together with B, both are named. */
static void assert_more(double share, const char *sentence)
{
    json_auto_t *c = claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3);
    json_object_set_new(c, "noise_share_a", json_real(share));
    assert_string_equal(plain_words_more_samples(c).s, sentence);
    json_object_update_new(c, json_pack("{ss sf ss sf}", "unit_a", "replicate", "n_a", 15.,
                                        "unit_b", "replicate", "n_b", 31.));
    assert_non_null(strstr(plain_words_claim(c).s, sentence));
    assert_non_null(strstr(plain_words_claim(c).s, share < 0.8
                                                       ? ": 38 replicates, and 78 of the reference"
                                                   : share < 1 ? ": 45 replicates"
                                                               : ": 38 replicates"));
    assert_int_equal(strstr(plain_words_claim(c).s, "of the reference") != NULL, share < 0.8);
}

TEST(whose_samples_would_decide)
{
    assert_more(1, "about 2.5 times the samples would decide");
    assert_more(0.9, "about 3.0 times the samples would decide");
    assert_more(0.5, "about 2.5 times the samples on both sides would decide");
    assert_more(0.7, "about 2.5 times the samples on both sides would decide");
}

static char *printed(json_t *claims)
{
    char *text = NULL;
    json_auto_t *results = json_pack("{so}", "claims", claims);
    PRINTED(text, plain_words_print(f, results, "page.html"));
    return text;
}

TEST(three_lines)
{
    char *text = printed(json_pack("[oo]", claim_of("EQUIVALENT", "EQUIVALENT", 0, 0, 0, 3),
                                   claim_of("DIFFERENT", "DIFFERENT", 1, 0, 0, 3)));
    assert_string_equal(
        text,
        "\njudged: mine on 1 scene against truth: 2 comparisons\n"
        "result: all as it should be, 1 the same within their margins, 1 deliberate mistake found\n"
        "look:   page.html\n");
    free(text);
    /* -0.8 % +- 0.1 % of a tile is 0.7 of its margin of 1 %, +0.15 % of the image is a quarter of 0.2 %; a deliberate
     * mistake is none of these. */
    text = printed(json_pack(
        "[oooo]", claim_of("EQUIVALENT", "EQUIVALENT", 0.001, 0, 0, 3),
        with_significant(claim_of("EQUIVALENT", "EQUIVALENT", 0, 0, 0, 3), 0.0015, false, 3),
        with_significant(claim_of("EQUIVALENT", "EQUIVALENT", 0, 0, 0, 3), -0.008, true, 3),
        with_significant(claim_of("DIFFERENT", "DIFFERENT", 1, 0, 0, 3), 1, false, 3)));
    assert_non_null(strstr(text,
                           "\nnote:   mine is 0.80 % too dark in the 16 x 16 pixels at 32,0 on "
                           "12_point_plane (against truth), which is not noise, but within its "
                           "1 %; and 1 more\nlook: "));
    free(text);
    /* Worst first: what is the opposite of what was expected before what is undecided. */
    text = printed(json_pack("[oo]", claim_of("INCONCLUSIVE", "EQUIVALENT", 0, 0, 0, 3),
                             claim_of("DIFFERENT", "EQUIVALENT", 0.0101, 0, 0, 3)));
    assert_non_null(strstr(
        text, "result: 2 of 2 not as it should be: mine is 1.0 % too bright on 12_point_plane "
              "(against truth); mine is too noisy to tell"));
    free(text);
    /* A difference is no less true because something else could not be judged. */
    text = printed(json_pack("[o{ss ss ss ss ss sb}]",
                             claim_of("DIFFERENT", "EQUIVALENT", 0.0101, 0, 0, 3), "scene", "16_x",
                             "a", "mine", "b", "truth", "expected", "EQUIVALENT", "error",
                             "no light", "passed", 0));
    assert_non_null(strstr(text, "2 of 2 not as it should be: mine is 1.0 % too bright"));
    assert_non_null(strstr(text, "; mine could not be judged: no light"));
    free(text);
}
