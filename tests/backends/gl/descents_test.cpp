// Searches that the device runs by itself, against those that the host leads step by step.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "backends/gl/gl_session.h"
#include "core/base/error.h"
#include "core/descent.h"
#include "core/registration/level/methods.h"
#include "gl_scenes.h"
#include "raylign/registration.h"
#include "tests/support/as_hardware.h"

namespace raylign::detail::gl {
namespace {

/// Both solve alike, in double and from the same sums; elimination without pivots and series instead of sines differ in
/// the last bits, which steps pass on. Rays go by float, so that they show far less than this.
constexpr double kSolverTolerance_mm = 1e-6;

const ObjectExtent kExtent{.centre_ct_mm = {4, -3, 2}, .thickness_mm = 60, .radius_mm = 60};

struct DescentCase {
    Projector projector = Projector::joseph;
    Metric metric = Metric::gc;
    bool learns = false;
};

/// One scene in two sessions of one device.
struct Both {
    Both(const Api& api, const test::SpineScene& spine, const DescentCase& c = {}, const PipelineOptions& options = {})
        : context(open_device(api, {})), host(context, spine.scene(c.projector, c.metric), options) {
        PipelineOptions descending = options;
        descending.descends = true;
        device = std::make_unique<GlSession>(context, spine.scene(c.projector, c.metric), descending);
        learns = c.learns;
    }
    [[nodiscard]] LevelProblem problem(Session& session) const {
        return {.session = session,
                .start_world_from_ct = {},
                .extent = kExtent,
                .pixel_at_object_mm = 2,
                .initial_step_mm = 2,
                .step_tolerance_mm = 1e-3,
                .cost_tolerance = 1e-10,
                .max_iterations = 30,
                .before_batch = [] {},
                .learns = learns};
    }

    std::shared_ptr<Context> context;
    GlSession host;
    std::unique_ptr<GlSession> device;
    bool learns = false;
};

void expect_alike(const LevelOutcome& device, const LevelOutcome& host) {
    EXPECT_LT(apart_mm(device.world_from_ct, host.world_from_ct, kExtent), kSolverTolerance_mm);
    EXPECT_NEAR(device.cost, host.cost, 1e-9);
    EXPECT_EQ(device.iterations, host.iterations);
    EXPECT_EQ(device.termination, host.termination);
    EXPECT_NEAR(device.last_step_mm, host.last_step_mm, 1e-6);
    ASSERT_EQ(device.views.size(), host.views.size());
    for (std::size_t v = 0; v < host.views.size(); ++v) {
        EXPECT_NEAR(device.views[v].cost, host.views[v].cost, 1e-9);
        EXPECT_LE((device.views[v].gradient - host.views[v].gradient).norm(), 1e-5 * host.views[v].curvature.norm());
        EXPECT_LE((device.views[v].curvature - host.views[v].curvature).norm(), 1e-5 * host.views[v].curvature.norm());
    }
}

int& waits() {
    static int count = 0;
    return count;
}
Api counting_waits(Api api) {
    static decltype(api.gl.ClientWaitSync) wait = nullptr;
    wait = api.gl.ClientWaitSync;
    api.gl.ClientWaitSync = [](GLsync sync, GLbitfield flags, GLuint64 timeout) {
        ++waits();
        return wait(sync, flags, timeout);
    };
    return api;
}

TEST(GlDescents, EndWhereThoseOfTheHostEnd) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    for (const DescentCase& c : {DescentCase{}, DescentCase{.learns = true}, DescentCase{.metric = Metric::ncc},
                                 DescentCase{.projector = Projector::trilinear}}) {
        SCOPED_TRACE(std::string(metric_name(c.metric)) + " " + std::string(projector_name(c.projector)));
        Both both(api, spine, c);
        const auto starts = spine.poses(5);
        const auto host = run_gauss_newton_batch(both.problem(both.host), starts);
        const auto device = run_gauss_newton_batch(both.problem(*both.device), starts);
        ASSERT_EQ(device.size(), host.size());
        int steps = 0;
        for (std::size_t i = 0; i < host.size(); ++i) {
            SCOPED_TRACE(i);
            expect_alike(device[i], host[i]);
            steps += host[i].iterations;
        }
        EXPECT_GT(steps, 15) << "they have something to do";
        EXPECT_EQ(both.device->counters().linearizations, both.host.counters().linearizations);
    }
}

TEST(GlDescents, AreTheDevicesOwnOnlyWhereAskedFor) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine(12, 16);
    const DescentProblem problem{.centre_ct_mm = {0, 0, 0}, .radius_mm = 60, .before_batch = [] {}};
    const DescentStart start{spine.poses(1).front()};
    for (const Solver solver : {Solver::host, Solver::device}) {
        const auto session = make_gl_backend(api, {.solver = solver})->prepare(spine.scene());
        EXPECT_EQ(session->descend(problem, {&start, 1}).has_value(), solver == Solver::device);
    }
}

// What is read as a GPU would be: one wait a submission of four steps, with the next one in the queue already.
TEST(GlDescents, WaitOnceForSeveralSteps) {
    RAYLIGN_NEED_GL(loaded);
    const test::SpineScene spine;
    Both both(test::as_hardware(counting_waits(loaded)), spine);
    LevelProblem problem = both.problem(both.host);
    problem.start_world_from_ct = spine.poses(4).back();
    const LevelOutcome host = run_gauss_newton(problem, {});
    waits() = 0;
    LevelProblem descending = both.problem(*both.device);
    descending.start_world_from_ct = problem.start_world_from_ct;
    expect_alike(run_gauss_newton(descending, {}), host);
    const auto linearizations = static_cast<int>(both.device->counters().linearizations);
    EXPECT_GT(linearizations, 8);
    EXPECT_LE(waits(), linearizations / 4 + 2);
}

TEST(GlDescents, TellEachStepAndStopWhereTheyAreToldTo) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    Both both(api, spine);
    struct Told {
        OptimizerStep step;
        RigidTransform pose;
    };
    const auto told_by = [&](Session& session, int most) {
        std::vector<Told> told;
        LevelProblem problem = both.problem(session);
        problem.start_world_from_ct = spine.poses(4).back();
        const LevelOutcome outcome = run_gauss_newton(problem, [&](const OptimizerStep& s, const RigidTransform& p) {
            told.push_back({s, p});
            return static_cast<int>(told.size()) < most;
        });
        EXPECT_EQ(outcome.termination == Termination::stopped, static_cast<int>(told.size()) == most);
        EXPECT_GE(outcome.iterations, static_cast<int>(told.size()));
        return told;
    };
    const auto host = told_by(both.host, 100), device = told_by(*both.device, 100);
    ASSERT_EQ(device.size(), host.size());
    ASSERT_GT(host.size(), 5u);
    for (std::size_t i = 0; i < host.size(); ++i) {
        EXPECT_EQ(device[i].step.iteration, static_cast<int>(i) + 1);
        EXPECT_NEAR(device[i].step.cost, host[i].step.cost, 1e-9);
        EXPECT_NEAR(device[i].step.length, host[i].step.length, 1e-6);
        EXPECT_LT(apart_mm(device[i].pose, host[i].pose, kExtent), kSolverTolerance_mm);
    }
    EXPECT_EQ(told_by(*both.device, 2).size(), 2u);
}

TEST(GlDescents, BeginWithWhatIsKnownOfTheStart) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    Both both(api, spine);
    const RigidTransform start = spine.poses(3).back();
    LevelProblem problem = both.problem(*both.device);
    problem.start_world_from_ct = start;
    const LevelOutcome anew = run_gauss_newton(problem, {});
    const auto all = both.device->counters().linearizations;
    problem.at_start.resize(both.device->view_count());
    both.host.linearize_views({&start, 1}, kExtent.centre_ct_mm, problem.at_start);
    expect_alike(run_gauss_newton(problem, {}), anew);
    EXPECT_EQ(both.device->counters().linearizations, 2 * all - 1);
}

TEST(GlDescents, DoNotDependOnTheBatchOrItsChunks) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine(12, 16);
    Both whole(api, spine);
    Both chunks(api, spine, {}, {.work_bytes = 80000});  // a few frames
    const auto starts = spine.poses(70);                 // more than the work group has lanes
    const auto all = run_gauss_newton_batch(whole.problem(*whole.device), starts);
    const auto by_chunks = run_gauss_newton_batch(chunks.problem(*chunks.device), starts);
    for (const std::size_t i : {0, 1, 33, 64, 69}) {
        LevelProblem problem = whole.problem(*whole.device);
        problem.start_world_from_ct = starts[i];
        const LevelOutcome alone = run_gauss_newton(problem, {});
        EXPECT_EQ(to_matrix(alone.world_from_ct), to_matrix(all[i].world_from_ct));
        EXPECT_EQ(to_matrix(alone.world_from_ct), to_matrix(by_chunks[i].world_from_ct));
        EXPECT_EQ(alone.cost, all[i].cost);
    }
}

// A view from the front whose rays come to run along another axis when the object has turned.
TEST(GlDescents, AskForLayoutsOfTheVolumeOnTheWay) {
    RAYLIGN_NEED_GL(api);
    test::SpineScene spine;
    const double turned_rad = 44 * std::numbers::pi / 180;
    const RigidTransform truth = exp((Twist() << 0, 0, turned_rad, 2, 1, -1).finished());
    spine.views =
        test::with_exact_images({{"AP", test::c_arm_view(0, 33), {}, {}}}, spine_phantom({160, 160, 160}), truth);
    Both both(api, spine);
    const RigidTransform start = exp((Twist() << 0, 0, turned_rad - 0.25, 1, 0, 0).finished());
    LevelProblem host = both.problem(both.host), device = both.problem(*both.device);
    host.start_world_from_ct = device.start_world_from_ct = start;
    const std::string before = both.device->volume_layout();
    expect_alike(run_gauss_newton(device, {}), run_gauss_newton(host, {}));
    EXPECT_NE(both.device->volume_layout(), before);
    EXPECT_EQ(both.device->volume_layout(), both.host.volume_layout());
}

TEST(GlDescents, EndAtOnceWhereNothingIsSeenAndAtTheLimit) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    Both both(api, spine);
    for (const double aside_mm : {0.0, 2000.0}) {
        LevelProblem host = both.problem(both.host), device = both.problem(*both.device);
        host.max_iterations = device.max_iterations = 2;
        host.start_world_from_ct = device.start_world_from_ct =
            RigidTransform::translate({aside_mm, 0, 0}) * spine.poses(4).back();
        const LevelOutcome here = run_gauss_newton(host, {});
        EXPECT_EQ(here.termination, aside_mm > 0 ? Termination::converged : Termination::max_iterations);
        expect_alike(run_gauss_newton(device, {}), here);
    }
}

TEST(GlDescents, FollowWeightsSharesAndCeilings) {
    RAYLIGN_NEED_GL(api);
    test::SpineScene spine;
    spine.views[0].cost_weight = 3;
    spine.views[1].ceiling = 4;
    Both both(api, spine);
    std::vector<Image> weights;
    for (int v = 0; v < 2; ++v) {
        weights.emplace_back(33, 33, 1);
        for (int x = 0; x < 12; ++x) weights[v](x, 16 + v) = 0.1F;
    }
    both.host.set_weights(weights);
    both.device->set_weights(weights);
    LevelProblem host = both.problem(both.host), device = both.problem(*both.device);
    host.start_world_from_ct = device.start_world_from_ct = spine.poses(3).back();
    expect_alike(run_gauss_newton(device, {}), run_gauss_newton(host, {}));
}

TEST(GlDescents, MakeTheSameRegistration) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine(32, 64);
    const RigidTransform start = RigidTransform::translate({2, -3, 1}) * test::oblique_pose();
    std::vector<RegistrationResult> results;
    std::vector<std::string> told;
    for (const Solver solver : {Solver::host, Solver::device}) {
        const auto backend = make_gl_backend(api, {.solver = solver});
        results.push_back(register_volume(spine.volume, spine.views, start, {}, *backend));
        told.push_back(backend->info().solver);
    }
    EXPECT_EQ(told, (std::vector<std::string>{"host", "device"}));
    EXPECT_LT(apart_mm(results[1].world_from_ct, results[0].world_from_ct, kExtent), kSolverTolerance_mm);
    EXPECT_LT(apart_mm(results[0].world_from_ct, test::oblique_pose(), kExtent), 1) << "the right one";
    EXPECT_EQ(results[1].ok, results[0].ok);
    EXPECT_EQ(results[1].iterations, results[0].iterations);
    EXPECT_EQ(results[1].counters.linearizations, results[0].counters.linearizations);
}

TEST(GlDescents, RefuseWhatTheHostRefusesAndSurviveWhatItThrows) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine(12, 16);
    Both both(api, spine);
    LevelProblem problem = both.problem(*both.device);
    problem.start_world_from_ct.translation_mm.x() = std::nan("");
    EXPECT_THROW((void)run_gauss_newton(problem, {}), Error);
    problem.start_world_from_ct = spine.poses(1).front();
    problem.before_batch = [] { throw Error("enough"); };
    EXPECT_THROW((void)run_gauss_newton(problem, {}), Error);
    problem.before_batch = [] {};
    EXPECT_GT(run_gauss_newton(problem, {}).iterations, 0);
}

}  // namespace
}  // namespace raylign::detail::gl
