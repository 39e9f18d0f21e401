/* The two loops over pairs of total-Lagrangian SPH, as plainly as C has them: rows of neighbours, stored W'/r, the correction
   outside the loop. What a compiler makes of them is the ceiling that tests/benchmarks/peers.py compares with. Compiled with REAL as float or double. */

void gradients(int n, const int *offsets, const int *indices, const REAL *weight, const REAL *node, const REAL *u,
               const REAL *moment, REAL *gradient)
{
    for (int i = 0; i < n; ++i) {
        const REAL x0 = node[3*i], x1 = node[3*i+1], x2 = node[3*i+2];
        const REAL u0 = u[3*i], u1 = u[3*i+1], u2 = u[3*i+2];
        REAL a00 = 0, a01 = 0, a02 = 0, a10 = 0, a11 = 0, a12 = 0, a20 = 0, a21 = 0, a22 = 0;
        for (int k = offsets[i]; k < offsets[i+1]; ++k) {
            const int j = 3 * indices[k];
            const REAL r0 = node[j] - x0, r1 = node[j+1] - x1, r2 = node[j+2] - x2;
            const REAL d0 = weight[k] * (u[j] - u0), d1 = weight[k] * (u[j+1] - u1), d2 = weight[k] * (u[j+2] - u2);
            a00 += d0*r0; a01 += d0*r1; a02 += d0*r2;
            a10 += d1*r0; a11 += d1*r1; a12 += d1*r2;
            a20 += d2*r0; a21 += d2*r1; a22 += d2*r2;
        }
        const REAL *m = moment + 9*i;
        REAL *g = gradient + 9*i;
        for (int c = 0; c < 3; ++c) {
            g[c] = a00*m[c] + a01*m[3+c] + a02*m[6+c];
            g[3+c] = a10*m[c] + a11*m[3+c] + a12*m[6+c];
            g[6+c] = a20*m[c] + a21*m[3+c] + a22*m[6+c];
        }
    }
}

void forces(int n, const int *offsets, const int *indices, const REAL *weight, const REAL *node, const REAL *corrected,
            REAL *force)
{
    for (int i = 0; i < n; ++i) {
        const REAL x0 = node[3*i], x1 = node[3*i+1], x2 = node[3*i+2];
        const REAL *a = corrected + 9*i;
        const REAL a0 = a[0], a1 = a[1], a2 = a[2], a3 = a[3], a4 = a[4], a5 = a[5], a6 = a[6], a7 = a[7], a8 = a[8];
        REAL f0 = 0, f1 = 0, f2 = 0;
        for (int k = offsets[i]; k < offsets[i+1]; ++k) {
            const int j = indices[k];
            const REAL *b = corrected + 9*j;
            const REAL r0 = weight[k] * (node[3*j] - x0), r1 = weight[k] * (node[3*j+1] - x1), r2 = weight[k] * (node[3*j+2] - x2);
            f0 += (a0 + b[0])*r0 + (a1 + b[1])*r1 + (a2 + b[2])*r2;
            f1 += (a3 + b[3])*r0 + (a4 + b[4])*r1 + (a5 + b[5])*r2;
            f2 += (a6 + b[6])*r0 + (a7 + b[7])*r1 + (a8 + b[8])*r2;
        }
        force[3*i] = f0; force[3*i+1] = f1; force[3*i+2] = f2;
    }
}
