/* The functions of throughput_by_hand.py in C, for `cc -O3 -march=native`: rows of values and derivatives into `out`. */
#include <math.h>

#define ROOT 1.4142135623730951
#define SIDE 512

static const double X8[8] = {0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.40828267875217511,
                             0.59171732124782489, 0.7627662049581645, 0.89833323870681336, 0.98014492824876812};
static const double W8[8] = {0.050614268145188129, 0.11119051722668724, 0.15685332293894363, 0.18134189168918100,
                             0.18134189168918100, 0.15685332293894363, 0.11119051722668724, 0.050614268145188129};
static const double X4[4] = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629};
static const double W4[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};

static inline double least(double a, double b) { return a < b ? a : b; }
static inline double most(double a, double b) { return a > b ? a : b; }
static inline double within(double x, double a, double b) { return least(most(x, a), b); }

static void cut(double c, double h, double *value, double *rate) {
    c /= h;
    double first = within(-c - 1, 0, 1), last = within(-c, 0, 1), v = 0, t = 0;
    for (int part = 0; part < 2; part++) {
        double a = part ? last : first, b = part ? 1 : last;
        if (b <= a) continue;
        for (int i = 0; i < 8; i++) {
            double x = a + (b - a) * X8[i], low = part ? 0 : within(-c - x, 0, 1), sv = 0, st = 0;
            for (int j = 0; j < 8; j++) {
                double w = 1 / (ROOT * h * (c + x + low + (1 - low) * X8[j]) + 2), s = w * w * W8[j];
                sv += s;
                st += s * w;
            }
            double weight = (b - a) * W8[i] * (1 - low);
            v += weight * sv;
            t += weight * st;
        }
    }
    *value = v * h * h;
    *rate = (last - first) / 4 * h - 2 * ROOT * h * h * t;
}

void half_plane(long n, const double *c, double h, double *out) {
    for (long k = 0; k < n; k++) cut(c[k], h, out + k, out + n + k);
}

void picture(long n, double c, double *out) {
    double h = 1.0 / SIDE;
    for (long k = 0; k < n; k++) {
        double z = (double)(k % SIDE) / SIDE + (double)(k / SIDE) / SIDE + c, v = 0, t = 0;
        if (z < 0 && z > -2 * h) cut(z, h, &v, &t);
        else if (z >= 0) {
            for (int i = 0; i < 4; i++)
                for (int j = 0; j < 4; j++) {
                    double w = 1 / (ROOT * (z + h * (X4[i] + X4[j])) + 2), s = w * w * W4[i] * W4[j];
                    v += s;
                    t += s * w;
                }
            v *= h * h;
            t *= -2 * ROOT * h * h;
        }
        out[k] = v;
        out[n + k] = t;
    }
}

static double under(double x, double r) { return (x * sqrt(most(r - x * x, 0)) + r * asin(least(x / sqrt(r), 1))) / 2; }

void disc(long n, double r, double *out) {
    double h = 1.0 / SIDE;
    for (long k = 0; k < n; k++) {
        double px = (double)(k % SIDE) / SIDE - 0.5, py = (double)(k / SIDE) / SIDE - 0.5;
        double x = least(fabs(px), fabs(px + h)), y = least(fabs(py), fabs(py + h)), v = 0, t = 0;
        if ((x + h) * (x + h) + (y + h) * (y + h) <= r) v = h * h;
        else if (x * x + y * y < r) {
            double left = within(sqrt(most(r - (y + h) * (y + h), 0)), x, x + h);
            double right = within(sqrt(most(r - y * y, 0)), x, x + h);
            v = (left - x) * h + under(right, r) - under(left, r) - y * (right - left);
            t = (asin(least(right / sqrt(r), 1)) - asin(least(left / sqrt(r), 1))) / 2;
        }
        out[k] = v;
        out[n + k] = t;
    }
}

static double ramp(double y, double h) {
    double inside = within(y, 0, h);
    return inside * inside / 2 + h * most(y - h, 0);
}

static void pair(const double *p, double x, double y, double h, double *out) {
    for (int i = 0; i < 7; i++) out[i] = 0;
    for (int e = 0; e < 3; e++) {
        int i = 2 * e, j = (2 * e + 2) % 6;
        double dx = p[j] - p[i], dy = p[j + 1] - p[i + 1], s = (x - p[i]) / dx, t = (y - p[i + 1]) / dy;
        double s2 = s + h / dx, t2 = t + h / dy;
        double lo = within(least(s, s2), 0, 1), hi = within(most(s, s2), 0, 1);
        out[0] -= dx * (ramp(p[i + 1] + hi * dy - y, h) - ramp(p[i + 1] + lo * dy - y, h)) / dy;
        lo = most(lo, least(t, t2));
        hi = most(lo, least(hi, most(t, t2)));
        double second = (hi * hi - lo * lo) / 2, first = hi - lo - second;
        out[1 + i] += dy * first;
        out[2 + i] -= dx * first;
        out[1 + j] += dy * second;
        out[2 + j] -= dx * second;
    }
}

void pairs(long n, const double *corners, const double *x, const double *y, double h, double *out) {
    for (long k = 0; k < n; k++) {
        double p[6], found[7];
        for (int i = 0; i < 6; i++) p[i] = corners[i * n + k];
        pair(p, x[k], y[k], h, found);
        for (int i = 0; i < 7; i++) out[i * n + k] = found[i];
    }
}

void triangle(long n, const double *corners, double t, double *out) {
    double p[6], found[7], h = 1.0 / SIDE;
    for (int i = 0; i < 6; i++) p[i] = corners[i] + (i % 2 ? 0 : t);
    for (long k = 0; k < n; k++) {
        pair(p, (double)(k % SIDE) / SIDE, (double)(k / SIDE) / SIDE, h, found);
        out[k] = found[0];
        out[n + k] = found[1] + found[3] + found[5];
    }
}

void kernel(long n, const double *x, const double *y, double c, double *out) {
    for (long k = 0; k < n; k++) {
        double w = 1 / (ROOT * (x[k] + y[k] + c) + 2), s = w * w;
        out[k] = s;
        out[n + k] = -2 * ROOT * s * w;
    }
}
