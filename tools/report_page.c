#include "report_page.h"

/* The assembler reads the files, so that nothing has to be generated; the parts of the script become one.
 * Paths are relative to the directory in which the compiler runs: the top of the repository. */
__asm__(".pushsection .rodata\n"
        ".global page_css, page_js\n"
        ".hidden page_css, page_js\n"
        "page_css: .incbin \"tools/page.css\"\n"
        ".byte 0\n"
        "page_js: .incbin \"tools/page_layer.js\"\n"
        ".incbin \"tools/page_maps.js\"\n"
        ".incbin \"tools/page_view.js\"\n"
        ".incbin \"tools/page_pixel.js\"\n"
        ".incbin \"tools/page_controls.js\"\n"
        ".incbin \"tools/page.js\"\n"
        ".incbin \"tools/page_keys.js\"\n"
        ".incbin \"tools/page_table.js\"\n"
        ".byte 0\n"
        ".popsection\n");
