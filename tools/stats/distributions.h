/* The few distribution functions that GSL lacks or floors: Student tails in log10 with no smallest
 * value, Student quantiles far out, degrees of freedom. Pure functions, no state. Where the
 * argument is out of its domain an assertion fails: these are called by us, never with user input.
 */
#ifndef ASSAY_DISTRIBUTIONS_H
#define ASSAY_DISTRIBUTIONS_H

/* log10 of P(|T| >= |t|) for Student's T with nu > 0 degrees of freedom, not necessarily whole; nu
 * may be INFINITY (normal). Relative error of p about 1e-10 near the centre, and of the logarithm
 * itself in the tail; never underflows: log10 p = -1e6 is as good as -1. 0 for t = 0. p = I_x(nu/2,
 * 1/2), x = nu/(nu + t^2) [AS64 26.7.1, 26.5.27], continued fraction [DLMF 8.17.22]. */
double stats_t_log10_p(double t, double nu);

/* t with P(T >= t) = q, 0 < q <= 0.5: an upper-tail quantile. nu as above. Relative error 1e-10
 * down to q = 1e-300. */
double stats_t_quantile(double q, double nu);

/* z with P(Z >= z) = q, 0 < q < 1. */
double stats_normal_quantile(double q);

/* Wallace's normal equivalent of t [Wallace59] and its inverse: P(|T| >= |t|) is about
 * P(|Z| >= |z|), within 3 % in z for nu >= 3. Monotone and cheap: for ranking, never
 * for a verdict. */
double stats_z_of_t(double t, double nu);
double stats_t_of_z(double z, double nu);

/* Hill's normal equivalent of t [Hill70]: P(|T| >= |t|) = P(|Z| >= |z|) up to O(nu^-4): to be
 * squared and summed. nu as above. */
double stats_hill_z(double t, double nu);

/* log10 of P(X >= x) for X of the chi-square law with k > 0 degrees of freedom, x >= 0; without a
 * floor, relative error of p about 1e-10 for k up to 1e6. Q(k/2, x/2) by its continued fraction
 * [DLMF 8.9.2] in logarithms above the centre, GSL below. */
double stats_chi2_log10_p(double x, double k);

/* Degrees of freedom of an estimate v of a variance that itself has the variance var_v: 2 v^2 /
 * var_v, the general form of Welch-Satterthwaite [Satterthwaite46]. INFINITY if var_v is 0. */
double stats_dof(double v, double var_v);

/* The two-sample case: squared standard errors va, vb of two means of na, nb >= 2 observations;
 * (va + vb)^2 / (va^2/(na-1) + vb^2/(nb-1)) [Welch47]. INFINITY if both are 0. */
double stats_welch_dof(double va, double na, double vb, double nb);

#endif
