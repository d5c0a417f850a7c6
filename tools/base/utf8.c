#include "utf8.h"

bool utf8_is_valid(const char *text)
{
    const unsigned char *c = (const unsigned char *)text;
    while (*c != '\0') {
        int more = *c < 0x80                  ? 0
                   : *c >= 0xc2 && *c <= 0xdf ? 1
                   : *c >= 0xe0 && *c <= 0xef ? 2
                   : *c >= 0xf0 && *c <= 0xf4 ? 3
                                              : -1;
        unsigned char low = *c == 0xe0 ? 0xa0 : *c == 0xf0 ? 0x90 : 0x80;
        unsigned char high = *c == 0xed ? 0x9f : *c == 0xf4 ? 0x8f : 0xbf;
        if (more < 0)
            return false;
        for (c++; more > 0; more--, c++) {
            if (*c < low || *c > high)
                return false;
            low = 0x80;
            high = 0xbf;
        }
    }
    return true;
}
