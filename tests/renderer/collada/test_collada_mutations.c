/* A valid scene, damaged in 12000 ways that are the same in every run. The loader must either load the
 * result or refuse it with one line; crashes, leaks and undefined behaviour are found by the sanitizers. */
#include "renderer/collada/collada.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

enum { MOST = 1 << 16, RUNS = 12000 };

/* xorshift [Marsaglia03]; any fixed non-zero seed will do. */
static uint32_t draw(uint32_t *state, uint32_t below)
{
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state % below;
}

static size_t truncate_text(char *text, size_t size, uint32_t *state)
{
    (void)text;
    return draw(state, (uint32_t)size);
}

static size_t flip_bits(char *text, size_t size, uint32_t *state)
{
    for (uint32_t i = 1 + draw(state, 3); i > 0; i--)
        text[draw(state, (uint32_t)size)] ^= (char)(1u << draw(state, 8));
    return size;
}

/* Other digits, signs and exponents keep the XML whole and reach the code behind it. */
static size_t spoil_number(char *text, size_t size, uint32_t *state)
{
    static const char WITH[] = "0123456789999-.e #";
    size_t at = draw(state, (uint32_t)size);
    for (size_t i = 0; i < size; i++, at = (at + 1) % size)
        if (text[at] >= '0' && text[at] <= '9')
            break;
    text[at] = WITH[draw(state, sizeof WITH - 1)];
    return size;
}

static size_t remove_run(char *text, size_t size, uint32_t *state)
{
    size_t at = draw(state, (uint32_t)size), n = 1 + draw(state, 40);
    if (at + n > size)
        n = size - at;
    memmove(text + at, text + at + n, size - at - n);
    return size - n;
}

/* A whole line is removed or doubled, which leaves many documents well-formed, because elements have lines
 * of their own. */
static size_t spoil_lines(char *text, size_t size, uint32_t *state)
{
    size_t start = draw(state, (uint32_t)size);
    while (start > 0 && text[start - 1] != '\n')
        start--;
    const char *nl = memchr(text + start, '\n', size - start);
    size_t n = nl != NULL ? (size_t)(nl - (text + start)) + 1 : size - start;
    if (draw(state, 2) == 0) {
        memmove(text + start, text + start + n, size - start - n);
        return size - n;
    }
    memmove(text + start + n, text + start, size - start);
    return size + n;
}

TEST(damaged_scenes_load_or_say_a_line)
{
    static size_t (*const DAMAGES[])(char *, size_t, uint32_t *) = {
        truncate_text, flip_bits, spoil_number, remove_run, spoil_lines};
    enum { KINDS = sizeof DAMAGES / sizeof *DAMAGES };
    static char text[MOST];
    OWN_TEXT original = test_read("tests/bad/00_valid.dae");
    const size_t size = strlen(original);
    assert_true(size > 1000 && size < MOST / 2);
    uint32_t seed = 20240229;
    int loaded[KINDS] = {0}, refused[KINDS] = {0};
    for (int run = 0; run < RUNS; run++) {
        int kind = run % KINDS;
        memcpy(text, original, size);
        size_t n = DAMAGES[kind](text, size, &seed);
        /* A block of its own, so that reading past the end is seen. */
        OWN_TEXT exact = malloc(n + (n == 0));
        assert_non_null(exact);
        memcpy(exact, text, n);
        struct scene s = {0};
        struct err e = {""};
        enum dialect dialect = run % 2 == 0 ? DIALECT_AUTO : DIALECT_CGL;
        if (collada_parse(exact, n, "damaged.dae", dialect, &s, &e)) {
            loaded[kind]++;
            assert_true(scene_num_primitives(&s) > 0);
            scene_free(&s);
        } else {
            refused[kind]++;
            if (strncmp(e.msg, "damaged.dae:", 12) != 0 || strlen(e.msg) < 20 ||
                strpbrk(e.msg, "\n\r\t") != NULL)
                fail_msg("run %d: not a good line: '%s'", run, e.msg);
        }
    }
    /* The damage must bite, and not always at the XML. */
    for (int kind = 0; kind < KINDS; kind++)
        assert_true(refused[kind] > 100);
    assert_true(loaded[2] > 100 && loaded[4] > 20);
}
