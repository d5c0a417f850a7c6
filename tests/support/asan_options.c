/* Defaults of AddressSanitizer for our programs, which ASAN_OPTIONS overrides. */

const char *__asan_default_options(void);

/* intercept_tls_get_addr: up to GCC 13 and LLVM 16 LeakSanitizer takes thread-local variables of a
 * library loaded late (oiio.so) for the layout of glibc 2.19 if they happen to lie 16 bytes into a
 * page, reads two words there as addresses, and dies: "LeakSanitizer has encountered a fatal
 * error". Turned off, it ignores these variables, as it does at any other place.
 * handle_sigill: undefined behaviour ends a program so (tests/tests.mk).
 * Some machines take ten microseconds to give a program a page of memory. clear_shadow_mmap_threshold: the shadow of a
 * large block is cleared, not given back and asked for anew with each block; quarantine_size_mb: a block that was
 * freed is used again after 16 MB, not 256. */
const char *__asan_default_options(void)
{
    return "intercept_tls_get_addr=0:handle_sigill=1:clear_shadow_mmap_threshold=500000:"
           "quarantine_size_mb=16";
}
