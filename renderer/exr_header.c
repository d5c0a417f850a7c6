#include "exr_header.h"

#include <stdint.h>

enum { MOST_NAME = 255, MOST_ATTRIBUTES = 10000 };
static const unsigned multi_part = 0x1000;

/* A text that a zero ends; its length, -1 if there is no end in sight. */
static int skip_text(FILE *f, long *left)
{
    for (int n = 0; n <= MOST_NAME && *left > 0; n++) {
        int c = getc(f);
        (*left)--;
        if (c == EOF)
            return -1;
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

bool exr_header_is_whole(FILE *f, unsigned version, long left)
{
    int in_header = 0;
    for (int i = 0; i < MOST_ATTRIBUTES; i++) {
        uint32_t length;
        int name = skip_text(f, &left);
        if (name < 0)
            return false;
        if (name == 0 && (!(version & multi_part) || in_header == 0))
            return true;
        in_header = name == 0 ? 0 : in_header + 1;
        if (name == 0)
            continue;
        if (skip_text(f, &left) <= 0 || !read_length(f, &left, &length) || (long)length > left ||
            fseek(f, (long)length, SEEK_CUR) != 0)
            return false;
        left -= (long)length;
    }
    return false;
}
