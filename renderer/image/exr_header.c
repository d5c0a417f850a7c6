#include "exr_header.h"

#include <stdint.h>
#include <string.h>

enum { MOST_NAME = 255, MOST_ATTRIBUTES = 10000 };
static const unsigned multi_part = 0x1000;

/* Reads a zero-terminated text; returns its length, or -1 if it does not end within MOST_NAME or *left bytes. */
static int read_text(FILE *f, long *left, char text[MOST_NAME + 1])
{
    for (int n = 0; n <= MOST_NAME && *left > 0; n++) {
        int c = getc(f);
        (*left)--;
        if (c == EOF)
            return -1;
        text[n] = (char)c;
        if (c == 0)
            return n;
    }
    return -1;
}

static bool read_length(FILE *f, long *left, uint32_t *out)
{
    unsigned char b[4];
    *left -= 4;
    if (*left < 0 || fread(b, 1, 4, f) != 4)
        return false;
    *out = b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
    return true;
}

static bool skip(FILE *f, long *left, long bytes)
{
    *left -= bytes;
    return *left >= 0 && fseek(f, bytes, SEEK_CUR) == 0;
}

/* Types of fixed size: OpenEXR reads that many bytes whatever length the attribute states, and takes what follows for
 * the next attribute. */
static long size_of(const char *type, long length)
{
    static const struct {
        const char *type;
        long size;
    } fixed[] = {{"box2i", 16},      {"box2f", 16},   {"chromaticities", 32},
                 {"compression", 1}, {"double", 8},   {"envmap", 1},
                 {"float", 4},       {"int", 4},      {"keycode", 28},
                 {"lineOrder", 1},   {"m33f", 36},    {"m33d", 72},
                 {"m44f", 64},       {"m44d", 128},   {"rational", 8},
                 {"tiledesc", 9},    {"timecode", 8}, {"v2i", 8},
                 {"v2f", 8},         {"v2d", 16},     {"v3i", 12},
                 {"v3f", 12},        {"v3d", 24}};
    for (size_t i = 0; i < sizeof fixed / sizeof *fixed; i++)
        if (strcmp(type, fixed[i].type) == 0)
            return fixed[i].size;
    return length;
}

/* Channels: a name and 16 bytes each, up to an empty name. */
static bool skip_channels(FILE *f, long *left)
{
    char name[MOST_NAME + 1];
    enum { EACH = 16 };
    for (;;) {
        int n = read_text(f, left, name);
        if (n <= 0)
            return n == 0;
        if (!skip(f, left, EACH))
            return false;
    }
}

/* Texts, each preceded by its length. */
static bool skip_texts(FILE *f, long *left)
{
    uint32_t length;
    while (*left > 0)
        if (!read_length(f, left, &length) || !skip(f, left, (long)length))
            return false;
    return true;
}

/* Width, height, and four bytes per pixel. */
static bool skip_preview(FILE *f, long *left)
{
    uint32_t width, height;
    return read_length(f, left, &width) && read_length(f, left, &height) &&
           (width == 0 || height <= (uint32_t)INT32_MAX / 4 / width) &&
           skip(f, left, 4 * (long)width * (long)height);
}

/* Skips a value as OpenEXR would read it; false unless that takes exactly `length` bytes. */
static bool skip_value(FILE *f, const char *type, long length)
{
    long left = length;
    bool ok = strcmp(type, "chlist") == 0         ? skip_channels(f, &left)
              : strcmp(type, "stringvector") == 0 ? skip_texts(f, &left)
              : strcmp(type, "preview") == 0      ? skip_preview(f, &left)
                                                  : skip(f, &left, size_of(type, length));
    return ok && left == 0;
}

bool exr_header_is_whole(FILE *f, unsigned version, long left)
{
    int in_header = 0;
    for (int i = 0; i < MOST_ATTRIBUTES; i++) {
        char text[MOST_NAME + 1];
        uint32_t length;
        int name = read_text(f, &left, text);
        if (name < 0)
            return false;
        if (name == 0 && (!(version & multi_part) || in_header == 0))
            return true;
        in_header = name == 0 ? 0 : in_header + 1;
        if (name == 0)
            continue;
        if (read_text(f, &left, text) <= 0 || !read_length(f, &left, &length) ||
            (long)length > left || !skip_value(f, text, (long)length))
            return false;
        left -= (long)length;
    }
    return false;
}
