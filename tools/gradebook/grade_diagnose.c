#include "grade_diagnose.h"

#include <math.h>

static json_t *named_json(const struct catalogue *c, const struct diagnosis *found)
{
    json_t *named = json_array();
    for (int i = 0; i < found->num_named; i++) {
        const struct candidate *one = &found->candidate[i];
        const struct bug *b = &c->bug[one->bug],
                         *other = one->second >= 0 ? &c->bug[one->second] : NULL;
        char name[64];
        catalogue_mistake(b, name);
        json_t *explained = isnan(one->explained) ? json_null() : json_real(one->explained);
        json_t *entry = json_pack("{ss, ss, ss, so}", "name", name, "bug", b->what, "where",
                                  b->where, "explained", explained);
        if (other != NULL) {
            catalogue_mistake(other, name);
            json_object_update_new(entry, json_pack("{ss, ss, ss}", "and", name, "and_bug",
                                                    other->what, "and_where", other->where));
        }
        json_array_append_new(named, entry);
    }
    return named;
}

static json_t *parts_json(const struct catalogue *c, const struct rubric *r,
                          const struct mistake *m)
{
    json_t *parts = json_array();
    for (int p = 0; p < r->num_parts; p++)
        if (m->of_part[p].num_named > 0)
            json_array_append_new(parts, json_pack("{ss, so}", "part", r->part[p].number, "named",
                                                   named_json(c, &m->of_part[p])));
    return parts;
}

json_t *grade_diagnose_by_images(const struct rubric_bugs *b, const struct rubric *r,
                                 const struct mistake *m)
{
    if (!m->looked)
        return m->why[0] != '\0' ? json_pack("{ss}", "error", m->why) : json_null();
    const struct catalogue *c = &b->catalogue;
    return json_pack("{ss, ss, so, so, ss}", "finding",
                     m->found.finding == FINDING_BUG ? "bug" : "unknown", "gate", m->found.gate,
                     "named", named_json(c, &m->found), "parts", parts_json(c, r, m), "with",
                     r->set[m->with].name);
}
