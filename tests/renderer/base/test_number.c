/* number_parse() against strtod(), bit for bit, and on what is not a number. */
#include "renderer/base/number.h"
#include "renderer/math/sampler.h"
#include "tests/support/test.h"

static void check(const char *text)
{
    const char *end = NULL;
    double got = NAN, want = strtod(text, NULL);
    if (!number_parse(text, &end, &got))
        fail_msg("'%s' is refused", text);
    if (memcmp(&got, &want, sizeof got) != 0)
        fail_msg("'%s' is read as %.17g", text, got);
    assert_true(*end == '\0' || *end == ' ');
}

TEST(like_strtod)
{
    static const char *const formats[] = {"%.9g", "%.17g",    "%.6f", "%.3e",
                                          "%g ",  "%+.12g 7", "%.1f", "%.20f"};
    char text[512];
    for (uint32_t i = 0; i < 400000; i++) {
        struct sample4 u = sampler_get(7, i, 0, 0, 0);
        double magnitude = exp2((i % 2 ? 40 : 600) * (2 * (double)u.u[2] - 1));
        double v = (2 * (double)u.u[0] - 1) * magnitude + (double)u.u[1] * 1e-9 * magnitude;
        snprintf(text, sizeof text, formats[i % 8], v);
        check(text);
    }
    /* The ends of what is exact, ties between two doubles, zeros, and no digits on one side. */
    static const char *const cases[] = {"9007199254740992",
                                        "9007199254740993",
                                        "9007199254740993e0",
                                        "9007199254740991e22",
                                        "9007199254740991e-22",
                                        "9007199254740991e23",
                                        "1e22",
                                        "1e23",
                                        "1e-22",
                                        "1e-23",
                                        "0",
                                        "-0",
                                        "-0.0",
                                        "+5",
                                        "5.",
                                        ".5",
                                        "-.5e1",
                                        "00000000000000000000001",
                                        "0.00000000000000000000001",
                                        "9999999999999999999",
                                        "99999999999999999999",
                                        "1e308",
                                        "4.9e-324",
                                        "2.5e-324",
                                        "1e-400",
                                        "123456789012345678901234567890",
                                        "8.5",
                                        "1E5",
                                        "1e+5",
                                        "1e05",
                                        "1e00005"};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        check(cases[i]);
}

TEST(what_is_no_number)
{
    static const char *const cases[] = {
        "",  " 1",  "nan", "inf",   "-inf", "0x10", "1e",    "1e+",   "e5",     ".",    "-",
        "+", "--1", "1-",  "1.2.3", "1,5",  "1f",   "1e5e5", "1e999", "-1e999", "1e5.", "five"};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *end;
        double v;
        if (number_parse(cases[i], &end, &v))
            fail_msg("'%s' is read as %g", cases[i], v);
    }
}
