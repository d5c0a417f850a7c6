#include "sha256.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static void finish(struct sha256_ctx *ctx, char hex[65])
{
    uint8_t digest[SHA256_DIGEST_SIZE];
    sha256_digest(ctx, sizeof digest, digest);
    base16_encode_update(hex, sizeof digest, digest);
    hex[64] = '\0';
}

bool sha256_file(const char *path, char hex[65], struct err *e)
{
    FILE *f = fs_open(path);
    if (f == NULL)
        return err_set(e, "%s: %s", path, strerror(errno));
    struct sha256_ctx ctx;
    sha256_init(&ctx);
    uint8_t buf[16384];
    size_t n;
    while ((n = fread(buf, 1, sizeof buf, f)) > 0)
        sha256_update(&ctx, n, buf);
    bool ok = ferror(f) == 0;
    if (!ok)
        err_set(e, "%s: %s", path, strerror(errno));
    fclose(f);
    if (!ok)
        return false;
    finish(&ctx, hex);
    return true;
}

void sha256_bytes(const void *bytes, size_t num, char hex[65])
{
    struct sha256_ctx ctx;
    sha256_init(&ctx);
    sha256_update(&ctx, num, bytes);
    finish(&ctx, hex);
}

void sha256_text(const char *text, char hex[65])
{
    sha256_bytes(text, strlen(text), hex);
}
