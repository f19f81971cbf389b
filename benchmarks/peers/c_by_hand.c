/* The hybrid loop with sliding-window ADFC, vectorised by hand: eight trials to a vector.
 *
 * An independent writing of the job in job.py; c_by_hand.py builds and feeds it.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define W 8
#define TAPS 5
#define LEAD 6
#define NLAG 20
typedef double v __attribute__((vector_size(8 * W)));
typedef double vu __attribute__((vector_size(8 * W), aligned(8)));
typedef long long vi __attribute__((vector_size(8 * W)));

typedef struct {
  int N, nb;
  int ns;                 /* slots of the numerical substructure */
  double pull;            /* weight of the pull towards the anchor */
  double anchor[16];      /* (8,2) */
  double start[16];       /* (8,2) */
  double cond;            /* largest accepted condition estimate */
  double arm, sin_a, cos_a;
} Params;

static inline v bc(double x) { return (v){x, x, x, x, x, x, x, x}; }
static inline v sel(vi m, v a, v b) { return (v)(((vi)a & m) | ((vi)b & ~m)); }
static inline v vabs(v x) { return sel(x < 0, -x, x); }
static inline v vmax(v a, v b) { return sel(a > b, a, b); }
static inline v vsqrt(v x) { v r; for (int i = 0; i < W; i++) r[i] = __builtin_sqrt(x[i]); return r; }

static inline v vsin(v x) {
  v s = x * x, r = bc(1.0);
  for (int n = 8; n > 0; n--) r = 1.0 - s / (2.0 * n * (2 * n + 1)) * r;
  return x * r;
}
static inline v vangle(v sine, v cosine) {
  v half = sine / (1 + cosine);
  v quarter = half / (1 + vsqrt(1 + half * half));
  v s = quarter * quarter, r = bc(0.0);
  for (int n = 14; n > 0; n--) r = s * (1.0 / (2 * n + 1) - r);
  return 4 * quarter * (1 - r);
}
static const double CD[4][5] = {
    {1, 0, 0, 0, 0}, {1.5, -2, 0.5, 0, 0}, {2, -5, 4, -1, 0}, {2.5, -9, 12, -7, 1.5}};

static inline void regress(v taps[2][TAPS], const v x[2], v phi[8]) {
  for (int a = 0; a < 2; a++) {
    for (int i = TAPS - 1; i > 0; i--) taps[a][i] = taps[a][i - 1];
    taps[a][0] = x[a];
    for (int d = 0; d < 4; d++) {
      v s = bc(0);
      for (int i = 0; i < TAPS; i++) s += CD[d][i] * taps[a][i];
      phi[4 * a + d] = s;
    }
  }
}

static inline void add_row(v G[36], v h[16], const v phi[8], const v u[2], double sign) {
  int n = 0;
  for (int j = 0; j < 8; j++) {
    v p = sign * phi[j];
    for (int i = j; i < 8; i++) G[n++] += p * phi[i];
    h[2 * j] += p * u[0];
    h[2 * j + 1] += p * u[1];
  }
}

/* Newest targets x and strokes y; products of y, LEAD samples late, with the last NLAG of x. */
static inline void correlate(v cr[4][NLAG], v hx[2][NLAG], v hy[4][LEAD + 1], const v x[2],
                             const v y[4]) {
  for (int i = 0; i < 2; i++) {
    memmove(&hx[i][1], &hx[i][0], sizeof(v) * (NLAG - 1));
    hx[i][0] = x[i];
  }
  for (int i = 0; i < 4; i++) {
    memmove(&hy[i][1], &hy[i][0], sizeof(v) * LEAD);
    hy[i][0] = y[i];
    for (int l = 0; l < NLAG; l++) cr[i][l] += hy[i][LEAD] * hx[i & 1][l];
  }
}

/* One block of W trials: own arrays come as (..., W), shared ones as plain doubles. */
void run(const Params *P, const double *ground, const double *ref, const double *noise,
         const double *pa, const double *pb, const double *pB, const double *pC,
         const double *na, const double *nb_, const double *nB, const double *nC, const double *nD,
         const double *ka, const double *kb, const double *kB, const double *kC, const double *kL,
         const double *R, const double *volt, double *sums, double *corr, double *info) {
  const int N = P->N, nb = P->nb, ns = P->ns;
  v a[8], b[8], B[8][2], C[2][8];
  for (int s = 0; s < 8; s++) {
    a[s] = *(const vu *)(pa + s * W);
    b[s] = *(const vu *)(pb + s * W);
    for (int i = 0; i < 2; i++) {
      B[s][i] = *(const vu *)(pB + (s * 2 + i) * W);
      C[i][s] = *(const vu *)(pC + (i * 8 + s) * W);
    }
  }
  v z[8] = {0}, zk[8] = {0}, x[64] = {0}, q1[2] = {0}, q2[2] = {0};
  v te[2][TAPS] = {0}, tl[2][TAPS] = {0}, tt[2][TAPS] = {0}, uprev[2] = {0};
  v Gold[36] = {0}, Gnew[36] = {0}, hold[16] = {0}, hnew[16] = {0}, c[16];
  for (int i = 0; i < 16; i++) c[i] = bc(P->start[i]);
  v es[10] = {0}, ts[10] = {0}, ep[10] = {0}, tp[10] = {0};
  v cr[4][NLAG] = {0}, hx[2][NLAG] = {0}, hy[4][LEAD + 1] = {0};
  v never = bc(1e15), first_bad = never, first_sat = never, peak = {0};
  v *ring = aligned_alloc(64, sizeof(v) * 4 * nb);
  memset(ring, 0, sizeof(v) * 4 * nb);
  for (int k = 0; k < N; k++) {
    v xm[2], y[2], xh[2];
    for (int i = 0; i < 2; i++) {
      v s = {0}, e = {0};
      for (int j = 0; j < 8; j++) { s += C[i][j] * z[j]; e += kC[i * 8 + j] * zk[j]; }
      xm[i] = s + *(const vu *)(noise + (size_t)k * W);
      y[i] = xm[i] - e;
    }
    v zc[8];
    for (int j = 0; j < 8; j++) zc[j] = zk[j] + kL[2 * j] * y[0] + kL[2 * j + 1] * y[1];
    for (int i = 0; i < 2; i++) {
      v s = {0};
      for (int j = 0; j < 8; j++) s += kC[i * 8 + j] * zc[j];
      xh[i] = s;
    }
    v x1 = xh[0] / 1e3, x2 = xh[1] / 1e3;
    v sine = (x1 - x2) / (2 * P->arm * P->sin_a), cosine = vsqrt(1 - sine * sine);
    v q[2] = {(x1 + x2) / 2 + P->arm * P->cos_a * sine * sine / (1 + cosine), vangle(sine, cosine)};
    if (k == 0) for (int i = 0; i < 2; i++) q1[i] = q2[i] = q[i];
    v load[4] = {bc(ground[k])};
    for (int f = 0; f < 3; f++) {
      v s = {0};
      for (int i = 0; i < 2; i++)
        s += R[f * 2 + i] * q[i] + R[6 + f * 2 + i] * q1[i] + R[12 + f * 2 + i] * q2[i];
      load[f + 1] = -s;
    }
    v num[6];
    for (int o = 0; o < 6; o++) {
      v s = {0};
      for (int j = 0; j < 2 * ns; j++) s += nC[o * 2 * ns + j] * x[j];
      for (int i = 0; i < 4; i++) s += nD[o * 4 + i] * load[i];
      num[o] = s;
    }
    v hs = vsin(num[1] / 2);
    v common = num[0] - 2 * P->arm * P->cos_a * hs * hs;
    v skew = P->arm * P->sin_a * 2 * hs * vsqrt(1 - hs * hs);
    v xa[2] = {1e3 * (common + skew), 1e3 * (common - skew)};

    /* controller */
    v phi[8], pl[8], pt[8], u[2];
    v *slot = ring + 4 * (k % nb);
    regress(te, xh, phi);
    regress(tl, slot, pl);
    regress(tt, xa, pt);
    add_row(Gold, hold, pl, slot + 2, -1.0);
    add_row(Gnew, hnew, phi, uprev, 1.0);
    slot[0] = xh[0]; slot[1] = xh[1]; slot[2] = uprev[0]; slot[3] = uprev[1];
    int since = k - (nb + TAPS - 1);
    if (since >= 0) {
      v M[8][10];
      v d0[8];
      int n = 0;
      for (int j = 0; j < 8; j++) {
        for (int i = j; i < 8; i++, n++) M[j][i] = Gold[n] + Gnew[n];
        M[j][j] += P->pull;
        for (int s = 0; s < 2; s++)
          M[j][8 + s] = P->pull * P->anchor[2 * j + s] + hold[2 * j + s] + hnew[2 * j + s];
        d0[j] = M[j][j];
      }
      vi good = (vi)(bc(0) == bc(0));
      v dmin = bc(1e300);
      for (int j = 0; j < 8; j++) {
        dmin = sel((M[j][j] / d0[j] < dmin) | (M[j][j] != M[j][j]), M[j][j] / d0[j], dmin);
        v inv = 1.0 / M[j][j];
        for (int i = j + 1; i < 8; i++) {
          v f = M[j][i] * inv;
          for (int m = i; m < 10; m++) M[i][m] -= f * M[j][m];
        }
      }
      good &= dmin > 1.0 / P->cond;
      v cn[16];
      for (int j = 7; j >= 0; j--)
        for (int s = 0; s < 2; s++) {
          v t = M[j][8 + s];
          for (int i = j + 1; i < 8; i++) t -= M[j][i] * cn[2 * i + s];
          cn[2 * j + s] = t / M[j][j];
        }
      for (int i = 0; i < 16; i++) c[i] = sel(good, cn[i], c[i]);
    }
    if ((k + 1) % nb == 0) {
      memcpy(Gold, Gnew, sizeof Gold); memcpy(hold, hnew, sizeof hold);
      memset(Gnew, 0, sizeof Gnew); memset(hnew, 0, sizeof hnew);
    }
    for (int s = 0; s < 2; s++) {
      v t = {0};
      for (int j = 0; j < 8; j++) t += c[2 * j + s] * pt[j];
      u[s] = t;
    }

    /* indices */
    const double *rf = ref + 6 * k;
    v val[10] = {xm[0], xm[1], q[0], q[1], q[0], q[1], num[2], num[3], num[4], num[5]};
    v tar[10] = {xa[0], xa[1], num[0], num[1], bc(rf[0]), bc(rf[1]),
                 bc(rf[2]), bc(rf[3]), bc(rf[4]), bc(rf[5])};
    for (int i = 0; i < 10; i++) {
      v e = val[i] - tar[i];
      es[i] += e * e; ts[i] += tar[i] * tar[i];
      ep[i] = vmax(ep[i], vabs(e)); tp[i] = vmax(tp[i], vabs(tar[i]));
    }
    const v yy[4] = {xm[0], xm[1], xh[0], xh[1]};
    correlate(cr, hx, hy, xa, yy);
    v kk = bc((double)k);
    for (int i = 0; i < 2; i++) {
      v vo = vabs(u[i] * volt[i] + volt[2 + i]);
      peak = vmax(peak, vo);
      first_sat = sel((vo > 3.8) & (first_sat == never), kk, first_sat);
      vi ok = (vabs(u[i]) <= 100) & (vabs(xm[i]) <= 100);
      first_bad = sel(~ok & (first_bad == never), kk, first_bad);
    }

    /* to k + 1 */
    v xn[64];
    for (int j = 0; j < 2 * ns; j += 2) {
      v s0 = na[j] * x[j] + nb_[j] * x[j + 1], s1 = na[j + 1] * x[j + 1] + nb_[j + 1] * x[j];
      for (int i = 0; i < 4; i++) { s0 += nB[j * 4 + i] * load[i]; s1 += nB[(j + 1) * 4 + i] * load[i]; }
      xn[j] = s0; xn[j + 1] = s1;
    }
    memcpy(x, xn, sizeof(v) * 2 * ns);
    for (int j = 0; j < 8; j += 2) {
      v s0 = a[j] * z[j] + b[j] * z[j + 1] + B[j][0] * u[0] + B[j][1] * u[1];
      v s1 = a[j + 1] * z[j + 1] + b[j + 1] * z[j] + B[j + 1][0] * u[0] + B[j + 1][1] * u[1];
      z[j] = s0; z[j + 1] = s1;
      s0 = ka[j] * zc[j] + kb[j] * zc[j + 1] + kB[2 * j] * u[0] + kB[2 * j + 1] * u[1];
      s1 = ka[j + 1] * zc[j + 1] + kb[j + 1] * zc[j] + kB[2 * j + 2] * u[0] + kB[2 * j + 3] * u[1];
      zk[j] = s0; zk[j + 1] = s1;
    }
    for (int i = 0; i < 2; i++) { q2[i] = q1[i]; q1[i] = q[i]; uprev[i] = u[i]; }
  }
  const v nothing[4] = {0};
  for (int k = 0; k < LEAD; k++) correlate(cr, hx, hy, nothing, nothing); /* what waited */
  for (int i = 0; i < 10; i++) {
    vu *o = (vu *)(sums + 4 * i * W);
    o[0] = es[i]; o[1] = ts[i]; o[2] = ep[i]; o[3] = tp[i];
  }
  memcpy(corr, cr, sizeof cr);
  vu *o = (vu *)info;
  o[0] = first_bad; o[1] = first_sat; o[2] = peak;
  free(ring);
}
