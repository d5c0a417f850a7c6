/* Arithmetic of triples and frames, written once for one number (vec.h) and for lanes of them (vec_simd.h), which
 * define HOW (the functions' storage class), the types, OF(name) (the functions' names), ROOT(), and SIGN_OF() (1 with
 * the sign of a number). */

HOW VEC3 OF(add)(VEC3 a, VEC3 b)
{
    return (VEC3){a.x + b.x, a.y + b.y, a.z + b.z};
}
HOW VEC3 OF(sub)(VEC3 a, VEC3 b)
{
    return (VEC3){a.x - b.x, a.y - b.y, a.z - b.z};
}
HOW VEC3 OF(scale)(VEC3 a, NUMBER s)
{
    return (VEC3){a.x * s, a.y * s, a.z * s};
}
HOW VEC3 OF(neg)(VEC3 a)
{
    return (VEC3){-a.x, -a.y, -a.z};
}
/* a + s b */
HOW VEC3 OF(mad)(VEC3 a, NUMBER s, VEC3 b)
{
    return (VEC3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
HOW NUMBER OF(dot)(VEC3 a, VEC3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HOW VEC3 OF(cross)(VEC3 a, VEC3 b)
{
    return (VEC3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/* a must not be zero. */
HOW VEC3 OF(normalize)(VEC3 a)
{
    return OF(scale)(a, 1.0f / ROOT(OF(dot)(a, a)));
}

HOW RGB OF(rgb_add)(RGB a, RGB b)
{
    return (RGB){a.r + b.r, a.g + b.g, a.b + b.b};
}
HOW RGB OF(rgb_mul)(RGB a, RGB b)
{
    return (RGB){a.r * b.r, a.g * b.g, a.b * b.b};
}
HOW RGB OF(rgb_scale)(RGB a, NUMBER s)
{
    return (RGB){a.r * s, a.g * s, a.b * s};
}

/* n must be of unit length. Branch-free but for the sign of n.z [Duff17]. */
HOW FRAME OF(frame_from_normal)(VEC3 n)
{
    NUMBER sign = SIGN_OF(n.z);
    NUMBER a = -1.0f / (sign + n.z);
    NUMBER b = n.x * n.y * a;
    return (FRAME){.s = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x},
                   .t = {b, sign + n.y * n.y * a, -n.y},
                   .n = n};
}
HOW VEC3 OF(frame_to_world)(const FRAME *f, VEC3 v)
{
    return OF(mad)(OF(mad)(OF(scale)(f->s, v.x), v.y, f->t), v.z, f->n);
}
HOW VEC3 OF(frame_to_local)(const FRAME *f, VEC3 w)
{
    return (VEC3){OF(dot)(w, f->s), OF(dot)(w, f->t), OF(dot)(w, f->n)};
}

#undef HOW
#undef NUMBER
#undef VEC3
#undef RGB
#undef FRAME
#undef OF
#undef ROOT
#undef SIGN_OF
