#include "dae.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <ctype.h>

static const char HEAD[] =
    "<?xml version='1.0'?>\n"
    "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\n"
    "<asset>%s</asset>\n<library_effects><effect id='grey-fx'><profile_COMMON><technique sid='c'><lambert><diffuse>"
    "<color>0.5 0.5 0.5 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>\n"
    "<library_materials><material id='grey'><instance_effect url='#grey-fx'/></material></library_materials>\n"
    "<library_geometries><geometry id='tri'><mesh><source id='tri-p'><float_array id='tri-a' count='9'>0 0 0 1 0 0 0 1 0"
    "</float_array><technique_common><accessor source='#tri-a' count='3' stride='3'><param name='X'/><param name='Y'/>"
    "<param name='Z'/></accessor></technique_common></source><vertices id='tri-v'><input semantic='POSITION' "
    "source='#tri-p'/></vertices><triangles material='m' count='1'><input semantic='VERTEX' source='#tri-v' offset='0'/>"
    "<p>0 1 2</p></triangles></mesh></geometry></library_geometries>\n";
static const char EFFECT[] =
    "<library_effects><effect id='x-fx'>%s</effect></library_effects>\n"
    "<library_materials><material id='x'><instance_effect url='#x-fx'/></material></library_materials>\n";
static const char MESH[] =
    "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='p-a' count='24'>0 0 0 2 0 0 2 1 0 1 1 0 1 2 "
    "0 0 2 0 0 0 1 5 5 5</float_array><technique_common><accessor source='#p-a' count='8' stride='3'><param name='X'/>"
    "<param name='Y'/><param name='Z'/></accessor></technique_common></source><source id='n'><float_array id='n-a' "
    "count='12'>0 0 1 1 1 0 0 0 0 0 0 -2</float_array><technique_common><accessor source='#n-a' count='4' stride='3'>"
    "<param name='X'/><param name='Y'/><param name='Z'/></accessor></technique_common></source><vertices id='v'><input "
    "semantic='POSITION' source='#p'/></vertices>%s</mesh></geometry></library_geometries>\n";
static const char NODES[] =
    "<library_visual_scenes><visual_scene id='w'>%s</visual_scene></library_visual_scenes>\n"
    "<scene><instance_visual_scene url='#w'/></scene></COLLADA>\n";
static const char INSTANCE[] =
    "<instance_geometry url='#%s'><bind_material><technique_common><instance_material symbol='m' target='#%s'/>"
    "</technique_common></bind_material></instance_geometry>";

/* Writes `around` with `piece` in the place of its "%s", each $ABBREVIATION of the piece expanded. */
static void put(FILE *f, const char *around, const char *piece)
{
    const char *hole = strstr(around, "%s");
    fwrite(around, 1, hole != NULL ? (size_t)(hole - around) : strlen(around), f);
    for (const char *at = piece != NULL ? piece : ""; *at != '\0'; at++) {
        char id[32] = "", material[32] = "grey";
        int n = 0;
        if (sscanf(at, "$%31[a-z]%n", id, &n) != 1) {
            fputc(*at, f);
            continue;
        }
        int more = 0;
        if (sscanf(at + n, ":%31[a-z]%n", material, &more) == 1)
            n += more;
        if (strcmp(id, "vertex") == 0)
            fputs("<input semantic='VERTEX' source='#v' offset='0'/>", f);
        else if (strcmp(id, "normal") == 0)
            fputs("<input semantic='NORMAL' source='#n' offset='1'/>", f);
        else
            fprintf(f, INSTANCE, id, material);
        at += n - 1;
    }
    if (hole != NULL)
        fputs(hole + 2, f);
}

char *dae_text(const struct dae *d)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    if (f == NULL)
        abort();
    put(f, HEAD, d->asset);
    if (d->effect != NULL)
        put(f, EFFECT, d->effect);
    if (d->mesh != NULL)
        put(f, MESH, d->mesh);
    put(f, "%s", d->libraries);
    put(f, NODES, d->nodes);
    fclose(f);
    return text;
}

bool dae_load(const struct dae *d, enum dialect dialect, struct scene *s, struct err *e)
{
    OWN_TEXT text = dae_text(d);
    bool ok = collada_parse(text, strlen(text), "test.dae", dialect, s, e);
    return ok;
}

void dae_must_fail(struct dae d, enum dialect dialect, const char *keyword)
{
    struct scene s = {0};
    struct err e;
    REFUSES(dae_load(&d, dialect, &s, &e), keyword);
    if (strncmp(e.msg, "test.dae:", 9) != 0)
        fail_msg("no place in '%s'", e.msg);
}
