#include "page_assets.h"

/* The assembler includes the files, so that nothing has to be generated; the scripts are concatenated.
 * Paths are relative to the directory in which the compiler runs: the top of the repository. */
__asm__(".pushsection .rodata\n"
        ".global page_css, page_js, plot_css\n"
        ".hidden page_css, page_js, plot_css\n"
        "page_css: .incbin \"tools/html/page_plot.css\"\n"
        ".incbin \"tools/html/page.css\"\n"
        ".byte 0\n"
        "plot_css: .incbin \"tools/html/page_plot.css\"\n"
        ".byte 0\n"
        "page_js: .incbin \"tools/html/page_layer.js\"\n"
        ".incbin \"tools/html/page_maps.js\"\n"
        ".incbin \"tools/html/page_view.js\"\n"
        ".incbin \"tools/html/page_pixel.js\"\n"
        ".incbin \"tools/html/page_controls.js\"\n"
        ".incbin \"tools/html/page.js\"\n"
        ".incbin \"tools/html/page_keys.js\"\n"
        ".incbin \"tools/html/page_table.js\"\n"
        ".incbin \"tools/html/page_save.js\"\n"
        ".byte 0\n"
        ".popsection\n");
