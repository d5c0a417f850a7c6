#include "suite_files.h"

#include <math.h>

static void cross3(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void unit3(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

static void skin(double s, double t, double p[3])
{
    double a = 2 * M_PI * s, b = 2 * M_PI * t;
    double c2 = cos(2 * a), s2 = sin(2 * a), c3 = cos(3 * a), s3 = sin(3 * a);
    double from_axis = 0.42 + 0.2 * c3;
    /* Away from the ring; along the tube, at right angles to that; the third direction. */
    double out[3] = {c3 * c2, s3, c3 * s2}, side[3];
    double along[3] = {-0.6 * s3 * c2 - 2 * from_axis * s2, 0.6 * c3,
                       -0.6 * s3 * s2 + 2 * from_axis * c2};
    unit3(along);
    cross3(along, out, side);
    double middle[3] = {from_axis * c2, 0.2 * s3, from_axis * s2};
    double r = 0.1 * (1 + 0.15 * cos(3 * b + 20 * a));
    for (int k = 0; k < 3; k++)
        p[k] = middle[k] + r * (cos(b) * out[k] + sin(b) * side[k]);
}

void suite_knot(double s, double t, double p[3], double n[3])
{
    const double h = 1e-5;
    double q[4][3], ds[3], dt[3];
    skin(s, t, p);
    skin(s + h, t, q[0]);
    skin(s - h, t, q[1]);
    skin(s, t + h, q[2]);
    skin(s, t - h, q[3]);
    for (int k = 0; k < 3; k++) {
        ds[k] = q[0][k] - q[1][k];
        dt[k] = q[2][k] - q[3][k];
    }
    cross3(dt, ds, n);
    unit3(n);
}

/* A number with so many digits behind the point, without zeros that tell nothing. */
static void number(FILE *f, double x, int digits)
{
    char text[32];
    snprintf(text, sizeof text, "%.*f", digits, x);
    char *end = text;
    while (*end != '\0')
        end++;
    while (end[-1] == '0')
        *--end = '\0';
    if (end[-1] == '.')
        *--end = '\0';
    const char *sign = text[0] == '-' ? "-" : "", *rest = text + (text[0] == '-');
    if (rest[0] == '0' && rest[1] == '\0')
        sign = "";
    else if (rest[0] == '0')
        rest++;
    fprintf(f, "%s%s", sign, rest);
}

static void knot_source(FILE *f, const char *id, int digits, int which)
{
    int vertices = KNOT_ALONG * KNOT_AROUND;
    fprintf(f, "        <source id=\"%s\">\n          <float_array id=\"%s-array\" count=\"%d\">\n",
            id, id, 3 * vertices);
    for (int i = 0; i < vertices; i++) {
        double v[2][3];
        suite_knot((double)(i / KNOT_AROUND) / KNOT_ALONG, (double)(i % KNOT_AROUND) / KNOT_AROUND,
                   v[0], v[1]);
        for (int k = 0; k < 3; k++) {
            number(f, v[which][k], digits);
            putc(k < 2 ? ' ' : '\n', f);
        }
    }
    fprintf(f,
            "          </float_array>\n          <technique_common>\n"
            "            <accessor source=\"#%s-array\" count=\"%d\" stride=\"3\">\n"
            "              <param name=\"X\" type=\"float\"/>\n"
            "              <param name=\"Y\" type=\"float\"/>\n"
            "              <param name=\"Z\" type=\"float\"/>\n"
            "            </accessor>\n          </technique_common>\n        </source>\n",
            id, vertices);
}

static void knot_geometry(FILE *f)
{
    fputs("    <geometry id=\"knot-geometry\">\n      <mesh>\n", f);
    knot_source(f, "knot-xyz", 4, 0);
    knot_source(f, "knot-n", 3, 1);
    fprintf(f,
            "        <vertices id=\"knot-vertices\">\n"
            "          <input semantic=\"POSITION\" source=\"#knot-xyz\"/>\n"
            "          <input semantic=\"NORMAL\" source=\"#knot-n\"/>\n"
            "        </vertices>\n"
            "        <triangles material=\"clay\" count=\"%d\">\n"
            "          <input semantic=\"VERTEX\" source=\"#knot-vertices\" offset=\"0\"/>\n"
            "          <p>\n",
            2 * KNOT_ALONG * KNOT_AROUND);
    for (int i = 0; i < KNOT_ALONG; i++)
        for (int k = 0; k < KNOT_AROUND; k++) {
            int here = i * KNOT_AROUND, next = (i + 1) % KNOT_ALONG * KNOT_AROUND;
            int up = (k + 1) % KNOT_AROUND;
            fprintf(f, "%d %d %d %d %d %d%s", here + k, here + up, next + up, here + k, next + up,
                    next + k, k + 1 < KNOT_AROUND ? " " : "\n");
        }
    fputs("          </p>\n        </triangles>\n      </mesh>\n    </geometry>\n", f);
}

static const struct {
    const char *name, *material, *corners;
} walls[] = {
    {"floor", "white", "-1 0 1  1 0 1  1 0 -1  -1 0 -1"},
    {"ceiling", "white", "-1 1.5 -1  1 1.5 -1  1 1.5 1  -1 1.5 1"},
    {"back", "white", "-1 0 -1  1 0 -1  1 1.5 -1  -1 1.5 -1"},
    {"left", "red", "-1 0 1  -1 0 -1  -1 1.5 -1  -1 1.5 1"},
    {"right", "blue", "1 0 -1  1 0 1  1 1.5 1  1 1.5 -1"},
};
enum { NUM_WALLS = sizeof walls / sizeof walls[0] };

static const struct {
    const char *name, *diffuse;
} paints[] = {{"white", "0.6 0.6 0.6"},
              {"red", "0.6 0.2 0.2"},
              {"blue", "0.2 0.2 0.6"},
              {"clay", "0.7 0.65 0.5"}};
enum { NUM_PAINTS = sizeof paints / sizeof paints[0] };

static void wall_geometry(FILE *f, int i)
{
    const char *n = walls[i].name;
    fprintf(f,
            "    <geometry id=\"%s-geometry\">\n      <mesh>\n        <source id=\"%s-xyz\">\n"
            "          <float_array id=\"%s-xyz-array\" count=\"12\">%s</float_array>\n"
            "          <technique_common>\n"
            "            <accessor source=\"#%s-xyz-array\" count=\"4\" stride=\"3\">\n"
            "              <param name=\"X\" type=\"float\"/>\n"
            "              <param name=\"Y\" type=\"float\"/>\n"
            "              <param name=\"Z\" type=\"float\"/>\n"
            "            </accessor>\n          </technique_common>\n        </source>\n",
            n, n, n, walls[i].corners, n);
    fprintf(f,
            "        <vertices id=\"%s-vertices\">\n"
            "          <input semantic=\"POSITION\" source=\"#%s-xyz\"/>\n        </vertices>\n"
            "        <triangles material=\"%s\" count=\"2\">\n"
            "          <input semantic=\"VERTEX\" source=\"#%s-vertices\" offset=\"0\"/>\n"
            "          <p>0 1 2  0 2 3</p>\n        </triangles>\n      </mesh>\n    </geometry>\n",
            n, n, walls[i].material, n);
}

static void node(FILE *f, const char *name, const char *place, const char *material)
{
    fprintf(f,
            "      <node id=\"%s\">\n%s        <instance_geometry url=\"#%s-geometry\">\n"
            "          <bind_material>\n            <technique_common>\n"
            "              <instance_material symbol=\"%s\" target=\"#%s\"/>\n"
            "            </technique_common>\n          </bind_material>\n"
            "        </instance_geometry>\n      </node>\n",
            name, place, name, material, material);
}

void suite_write_mesh(FILE *f)
{
    fputs("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
          "<!-- A knotted tube of 28800 triangles in a box. Written by make_suite_files; see "
          "44_mesh.md. -->\n"
          "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
          "  <asset>\n    <created>2026-11-21T00:00:00Z</created>\n"
          "    <modified>2026-11-21T00:00:00Z</modified>\n"
          "    <unit name=\"metre\" meter=\"1\"/>\n    <up_axis>Y_UP</up_axis>\n  </asset>\n\n"
          "  <library_cameras>\n    <camera id=\"camera\">\n      <optics>\n"
          "        <technique_common>\n          <perspective>\n            <xfov>39.6</xfov>\n"
          "            <aspect_ratio>1</aspect_ratio>\n            <znear>0.01</znear>\n"
          "            <zfar>100</zfar>\n          </perspective>\n        </technique_common>\n"
          "      </optics>\n    </camera>\n  </library_cameras>\n\n",
          f);
    fputs("  <!-- For other readers: a point light of the rectangle's intensity on its axis, "
          "radiance x area. -->\n"
          "  <library_lights>\n    <light id=\"lamp\">\n      <technique_common>\n"
          "        <point>\n          <color>5.76 5.76 5.76</color>\n"
          "          <constant_attenuation>0</constant_attenuation>\n"
          "          <linear_attenuation>0</linear_attenuation>\n"
          "          <quadratic_attenuation>1</quadratic_attenuation>\n        </point>\n"
          "      </technique_common>\n      <extra>\n        <technique profile=\"ASSAY\">\n"
          "          <rectangle>\n            <radiance>4 4 4</radiance>\n"
          "            <width>1.2</width>\n            <height>1.2</height>\n"
          "          </rectangle>\n        </technique>\n      </extra>\n    </light>\n"
          "  </library_lights>\n\n  <library_effects>\n",
          f);
    for (int i = 0; i < NUM_PAINTS; i++)
        fprintf(f,
                "    <effect id=\"%s-effect\">\n      <profile_COMMON>\n"
                "        <technique sid=\"common\">\n          <lambert>\n"
                "            <diffuse><color>%s 1</color></diffuse>\n          </lambert>\n"
                "        </technique>\n      </profile_COMMON>\n    </effect>\n",
                paints[i].name, paints[i].diffuse);
    fputs("  </library_effects>\n\n  <library_materials>\n", f);
    for (int i = 0; i < NUM_PAINTS; i++)
        fprintf(f, "    <material id=\"%s\"><instance_effect url=\"#%s-effect\"/></material>\n",
                paints[i].name, paints[i].name);
    fputs("  </library_materials>\n\n"
          "  <!-- Corners run counter-clockwise seen from the front. -->\n"
          "  <library_geometries>\n",
          f);
    for (int i = 0; i < NUM_WALLS; i++)
        wall_geometry(f, i);
    knot_geometry(f);
    fputs("  </library_geometries>\n\n  <library_visual_scenes>\n"
          "    <visual_scene id=\"scene\">\n",
          f);
    for (int i = 0; i < NUM_WALLS; i++)
        node(f, walls[i].name, "", walls[i].material);
    node(f, "knot",
         "        <translate>0 0.7 -0.1</translate>\n        <rotate>1 0 0 60</rotate>\n"
         "        <scale>0.9 0.9 0.9</scale>\n",
         "clay");
    fputs("      <!-- Emits along -Y; its height lies along Z. -->\n"
          "      <node id=\"light\">\n        <translate>0 1.49 0</translate>\n"
          "        <rotate>1 0 0 -90</rotate>\n        <instance_light url=\"#lamp\"/>\n"
          "      </node>\n      <node id=\"eye\">\n        <translate>0 0.75 3</translate>\n"
          "        <instance_camera url=\"#camera\"/>\n      </node>\n    </visual_scene>\n"
          "  </library_visual_scenes>\n\n"
          "  <scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n",
          f);
}

/* Horizon bright, both poles the same blue, so that a reader which joins the top row to the bottom row
 * finds what one that does not finds; below the horizon darker. The lobe of the sun ends 45 degrees
 * from its middle, short of the pole. */
void suite_sky_radiance(const double d[3], double radiance[3])
{
    static const double horizon[3] = {0.6, 0.57, 0.51}, pole[3] = {0.18, 0.3, 0.54};
    static const double sun[3] = {-0.6, 0.6, -0.52915026221291817}, lobe[3] = {6, 5, 4};
    const double edge = 0.70710678118654752;
    double y = d[1], ground = y < 0 ? 1 + 2 * y * (1 + y) : 1;
    double t = (d[0] * sun[0] + d[1] * sun[1] + d[2] * sun[2] - edge) / (1 - edge);
    t = fmin(fmax(t, 0), 1);
    for (int c = 0; c < 3; c++)
        radiance[c] =
            (horizon[c] + (pole[c] - horizon[c]) * y * y) * ground + lobe[c] * t * t * (3 - 2 * t);
}

bool suite_sky(int turn, struct image *out, struct err *e)
{
    if (!image_alloc(out, SKY_WIDTH, SKY_HEIGHT, 3, (const char *const[]){"R", "G", "B"}, e))
        return false;
    for (int y = 0; y < SKY_HEIGHT; y++)
        for (int x = 0; x < SKY_WIDTH; x++) {
            double theta = M_PI * (y + 0.5) / SKY_HEIGHT;
            double phi = 2 * M_PI * (x + 0.5) / SKY_WIDTH - M_PI;
            double d[3] = {sin(theta) * cos(phi), cos(theta), -sin(theta) * sin(phi)}, l[3];
            suite_sky_radiance(d, l);
            for (int c = 0; c < 3; c++)
                out->data[3 * (y * SKY_WIDTH + (x + turn) % SKY_WIDTH) + c] =
                    (float)(round(256 * l[c]) / 256);
        }
    return true;
}
