/* Defaults of AddressSanitizer for our programs, which ASAN_OPTIONS overrides. */

const char *__asan_default_options(void);

/* intercept_tls_get_addr: up to GCC 13 and LLVM 16 LeakSanitizer takes thread-local variables of a
 * library loaded late (oiio.so) for the layout of glibc 2.19 if they happen to lie 16 bytes into a
 * page, reads two words there as addresses, and dies: "LeakSanitizer has encountered a fatal
 * error". Turned off, it ignores these variables, as it does at any other place. */
const char *__asan_default_options(void)
{
    return "intercept_tls_get_addr=0";
}
