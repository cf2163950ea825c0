// Costs, gradients and Gauss-Newton matrices from sums (core/similarity/linearization.cpp).

/// Of all views, parameters in mm at the rim.
struct Model {
    double cost;
    double gradient[6];
    double curvature[36];
    bool is_finite;
};

int upper(int i, int j) { return 6 * i - i * (i - 1) / 2 + j - i; }  // of i <= j in the upper triangle, row by row

/// Adds the channel whose sums begin at `at`.
void add_channel(uint at, uint v, uint channel, inout ViewModel model) {
    const double weight = cameras[v].static_sums[3 * channel], of_a = cameras[v].static_sums[3 * channel + 1];
    const double a_a = cameras[v].static_sums[3 * channel + 2], of_b = sums[at], b_b = sums[at + 1];
    const double variance_b = b_b - of_b * of_b / weight;
    if (variance_b <= descent.constant_share * b_b) {
        model.cost += 1;
        return;
    }
    const double variance_a = a_a - of_a * of_a / weight, norm_a = sqrt(variance_a), norm_b = sqrt(variance_b);
    const double correlation = (sums[at + 2] - of_a * of_b / weight) / sqrt(variance_a * variance_b);
    model.cost += 1 - correlation;
    double mean[6], along_a[6], along_b[6];
    for (int i = 0; i < 6; ++i) {
        mean[i] = sums[at + 3 + i] / weight;
        along_a[i] = (sums[at + 9 + i] - of_a * mean[i]) / norm_a;
        along_b[i] = (sums[at + 15 + i] - of_b * mean[i]) / norm_b;
        model.gradient[i] -= (along_a[i] - correlation * along_b[i]) / norm_b;
    }
    for (int i = 0; i < 6; ++i) {
        for (int j = i; j < 6; ++j) {
            const double centred = sums[at + 21 + upper(i, j)] - weight * mean[i] * mean[j];
            model.curvature[upper(i, j)] += (centred - along_b[i] * along_b[j]) / (norm_b * norm_b);
        }
    }
}

ViewModel view_model(uint frame, uint v) {
    ViewModel model;
    model.cost = 0;
    for (int i = 0; i < 6; ++i) model.gradient[i] = 0;
    for (int i = 0; i < 21; ++i) model.curvature[i] = 0;
    for (uint c = 0; c < descent.channels; ++c) add_channel((frame * descent.channels + c) * kSums, v, c, model);
    const double channels = double(descent.channels);
    model.cost /= channels;
    for (int i = 0; i < 6; ++i) model.gradient[i] /= channels;
    for (int i = 0; i < 21; ++i) model.curvature[i] /= channels;
    return model;
}

/// The sum of views from models[first] on, each with its share in the cost.
Model sum_of_views(uint first) {
    Model all;
    all.cost = 0;
    for (int i = 0; i < 6; ++i) all.gradient[i] = 0;
    for (int i = 0; i < 36; ++i) all.curvature[i] = 0;
    for (uint v = 0; v < descent.views; ++v) {
        const double share = cameras[v].share;
        all.cost += share * models[first + v].cost;
        for (int i = 0; i < 6; ++i) {
            all.gradient[i] += share * models[first + v].gradient[i];
            for (int j = 0; j < 6; ++j) {
                all.curvature[6 * i + j] += share * models[first + v].curvature[upper(min(i, j), max(i, j))];
            }
        }
    }
    double of_all = all.cost;
    for (int i = 0; i < 6; ++i) {
        all.gradient[i] *= i < 3 ? 1 / descent.radius : 1;
        of_all += all.gradient[i];
        for (int j = 0; j < 6; ++j) {
            all.curvature[6 * i + j] *= (i < 3 ? 1 / descent.radius : 1) * (j < 3 ? 1 / descent.radius : 1);
            of_all += all.curvature[6 * i + j];
        }
    }
    all.is_finite = !isnan(of_all) && !isinf(of_all);
    return all;
}

/// Takes the models of views from their frames' sums.
void look(uint frame, uint first) {
    for (uint v = 0; v < descent.views; ++v) models[first + v] = view_model(frame + v, v);
}
