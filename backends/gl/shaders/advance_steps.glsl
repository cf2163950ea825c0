// The damped step and what it learns of missing curvature (core/optimize/levenberg_marquardt.cpp), and the pose it leads to.

double dot_of(double a[6], double b[6]) {
    double sum = 0;
    for (int i = 0; i < 6; ++i) sum += a[i] * b[i];
    return sum;
}
double norm_of(double a[6]) { return sqrt(dot_of(a, a)); }
double[6] product(double m[36], double x[6]) {
    double y[6];
    for (int i = 0; i < 6; ++i) {
        y[i] = 0;
        for (int j = 0; j < 6; ++j) y[i] += m[6 * i + j] * x[j];
    }
    return y;
}

/// x with m x = right, by L D L^T. Its matrices are damped: no pivots are sought.
double[6] solved(double m[36], double right[6]) {
    for (int j = 0; j < 6; ++j) {
        for (int k = 0; k < j; ++k) m[7 * j] -= m[6 * j + k] * m[6 * j + k] * m[7 * k];
        for (int i = j + 1; i < 6; ++i) {
            for (int k = 0; k < j; ++k) m[6 * i + j] -= m[6 * i + k] * m[6 * j + k] * m[7 * k];
            m[6 * i + j] = m[7 * j] == 0 ? 0 : m[6 * i + j] / m[7 * j];
        }
    }
    double x[6];
    for (int i = 0; i < 6; ++i) {
        x[i] = right[i];
        for (int k = 0; k < i; ++k) x[i] -= m[6 * i + k] * x[k];
    }
    for (int i = 5; i >= 0; --i) {
        x[i] = m[7 * i] == 0 ? 0 : x[i] / m[7 * i];
        for (int k = i + 1; k < 6; ++k) x[i] -= m[6 * k + i] * x[k];
    }
    return x;
}

/// No longer than max_step. `promised`: by how much the model says that the cost falls.
double[6] capped(double step[6], double gradient[6], double curvature[36], out double promised) {
    const double len = norm_of(step);
    if (len > descent.max_step) {
        for (int i = 0; i < 6; ++i) step[i] *= descent.max_step / len;
    }
    promised = -(dot_of(gradient, step) + 0.5lf * dot_of(step, product(curvature, step)));
    return step;
}

double[6] damped_step(uint search, out double promised) {
    double damped[36] = searches[search].curvature, gradient[6] = searches[search].gradient, against[6];
    double largest = damped[0];
    for (int i = 1; i < 6; ++i) largest = max(largest, damped[7 * i]);
    promised = 0;
    for (int i = 0; i < 6; ++i) against[i] = -gradient[i];
    if (!(largest > 0)) return double[6](0, 0, 0, 0, 0, 0);
    for (int i = 0; i < 6; ++i) {
        damped[7 * i] += searches[search].damping * max(damped[7 * i], descent.least_of_diagonal * largest);
    }
    const double plain[6] = solved(damped, against);
    if (descent.learns != 0) {
        double whole[36] = searches[search].curvature;
        for (int i = 0; i < 36; ++i) {
            damped[i] += searches[search].missing[i];
            whole[i] += searches[search].missing[i];
        }
        const double learnt[6] = solved(damped, against);
        const double share = norm_of(learnt) / norm_of(plain);
        if (dot_of(learnt, gradient) < 0 && share > 1 && share < descent.longest_of_plain) {
            return capped(learnt, gradient, whole, promised);
        }
    }
    return capped(plain, gradient, searches[search].curvature, promised);
}

/// The sized update of what the curvature leaves out, `model` being what the step led to.
void learn_missing(uint search, Model model) {
    const double step[6] = searches[search].step;
    double change[6], rest[6];
    for (int i = 0; i < 6; ++i) change[i] = model.gradient[i] - searches[search].gradient[i];
    const double along = dot_of(change, step);
    if (!(along > 0)) return;
    const double explained[6] = product(model.curvature, step);
    for (int i = 0; i < 6; ++i) rest[i] = change[i] - explained[i];  // what is unexplained
    double missing[36] = searches[search].missing;
    const double known = dot_of(step, product(missing, step)), seen = dot_of(step, rest);
    if (abs(known) > abs(seen)) {
        for (int i = 0; i < 36; ++i) missing[i] *= abs(seen / known);
    }
    const double by_now[6] = product(missing, step);
    for (int i = 0; i < 6; ++i) rest[i] -= by_now[i];
    const double both = dot_of(rest, step) / (along * along);
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) {
            missing[6 * i + j] += (rest[i] * change[j] + change[i] * rest[j]) / along - both * change[i] * change[j];
        }
    }
    searches[search].missing = missing;
}

/// Of rows, or of a pose's rotation.
dmat3 rotation_of(double pose[12]) {
    return transpose(dmat3(pose[0], pose[1], pose[2], pose[3], pose[4], pose[5], pose[6], pose[7], pose[8]));
}
dvec3 shift_of(double pose[12]) { return dvec3(pose[9], pose[10], pose[11]); }
dmat3 matrix_of(double rows[9]) {
    return transpose(dmat3(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8]));
}
dvec3 vector_of(double v[3]) { return dvec3(v[0], v[1], v[2]); }

/// sum of (-t^2)^k first! / (2 k + first)!: sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3, times first!, for first = 1, 2, 3.
double series(double t2, int first) {
    double term = 1, sum = 1;
    for (int k = 1; k < 40; ++k) {
        term *= -t2 / double((2 * k + first) * (2 * k + first - 1));
        sum += term;
    }
    return sum;
}

/// trial = the twist of `step` about the volume's centre, times base (exp_about of core/geometry/rigid_transform.cpp).
void move_trial(uint search, double step[6]) {
    const dmat3 rotation = rotation_of(searches[search].base);
    const dvec3 shift = shift_of(searches[search].base), centre = rotation * vector_of(descent.centre_ct) + shift;
    const dvec3 w = dvec3(step[0], step[1], step[2]) / descent.radius, v = dvec3(step[3], step[4], step[5]);
    const double t2 = dot(w, w), a = series(t2, 1), b = series(t2, 2) / 2, c = series(t2, 3) / 6;
    const dmat3 k = transpose(dmat3(0, -w.z, w.y, w.z, 0, -w.x, -w.y, w.x, 0)), one = dmat3(1);
    const dmat3 turn = one + a * k + b * (k * k), turned = turn * rotation;
    const dvec3 moved = turn * (shift - centre) + centre + (one + b * k + c * (k * k)) * v;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) searches[search].trial[3 * i + j] = turned[j][i];
        searches[search].trial[9 + i] = moved[i];
    }
}
