/* How programs under AddressSanitizer run unless ASAN_OPTIONS says otherwise. */

const char *__asan_default_options(void);

/* intercept_tls_get_addr: up to GCC 13 and LLVM 16 the search for leaks takes a thread's variables in a library loaded late (oiio.so) for
 * ones of glibc 2.19 where they lie 16 bytes into a page, follows two words that are no address, and dies: "LeakSanitizer has
 * encountered a fatal error". Where they lie is chance. Without it, it only leaves these variables alone, as it does at all other places. */
const char *__asan_default_options(void)
{
    return "intercept_tls_get_addr=0";
}
