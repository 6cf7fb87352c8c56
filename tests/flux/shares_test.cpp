#include "flux/shares.hpp"

#include <barrier>
#include <catch2/catch.hpp>
#include <cstring>
#include <thread>

#include "flux/radiosity/radiosity.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;

namespace {

// Ranks simulated by threads of this process.
class Team {
  public:
    explicit Team(std::uint32_t ranks)
        : ranks_(ranks), spans_(ranks), barrier_(static_cast<std::ptrdiff_t>(ranks)) {}

    // Runs \p work(shares) on every rank; returns the results.
    template <class Work>
    auto each(const Work& work) {
        std::vector<decltype(work(Shares{}))> results(ranks_);
        std::vector<std::thread> threads;
        for (std::uint32_t rank = 0; rank < ranks_; ++rank)
            threads.emplace_back([&, rank] {
                results[rank] = work(Shares{
                    rank, ranks_, [this, rank](std::span<std::uint64_t> values) { sum(rank, values); }});
            });
        for (std::thread& thread : threads) thread.join();
        return results;
    }

  private:
    void sum(std::uint32_t rank, std::span<std::uint64_t> values) {
        spans_[rank] = values;
        barrier_.arrive_and_wait();
        std::vector<std::uint64_t> total(values.size(), 0);
        for (const auto& span : spans_)
            for (std::size_t i = 0; i < total.size(); ++i) total[i] += span[i];
        barrier_.arrive_and_wait();
        std::copy(total.begin(), total.end(), values.begin());
        barrier_.arrive_and_wait();
    }

    std::uint32_t ranks_;
    std::vector<std::span<std::uint64_t>> spans_;
    std::barrier<> barrier_;
};

bool same(const FluxField& a, const FluxField& b) {
    return a.flux == b.flux && a.error == b.error;
}

void check_same(const FluxResult& a, const FluxResult& b) {
    REQUIRE(a.others.size() == b.others.size());
    for (std::size_t k = 0; k <= a.others.size(); ++k) {
        CHECK(same(a.tally(k).triangle, b.tally(k).triangle));
        CHECK(same(a.tally(k).wedge, b.tally(k).wedge));
        CHECK(same(a.tally(k).vertex, b.tally(k).vertex));
    }
    CHECK(a.relative_error == b.relative_error);
    CHECK(a.emitted == b.emitted);
    CHECK(a.absorbed == b.absorbed);
    CHECK(a.segments == b.segments);
    CHECK(a.rescued == b.rescued);
    CHECK(a.arrivals == b.arrivals);
    CHECK(a.ledger == b.ledger);
    CHECK(a.redeposited == b.redeposited);
    CHECK(a.ledger.balanced());
}

struct Trench {
    TriangleMesh mesh = extrude(trench_profile(2.0, 0.2, {0.3, 0.7}, {0.5}), 1.0, 3);
    surface::RayScene scene{mesh};
    LateralBox box = lateral_box(mesh, kPeriodic);
    Wedges wedges = make_wedges(mesh);
};

}  // namespace

TEST_CASE("ranks that share a trace get the bits of one process, yields and what is sputtered included") {
    const Trench t;
    Species ions{"ion", 200.0, {0.4}};
    ions.energy = {100.0, 10.0};
    ions.reflection = {.kind = Reemission::specular, .from = 0.5, .to = 1.5};
    ions.yields = {{"sputter", Angular::sputter, 20.0, {0.1}, {9.3}}};
    ions.redeposition = Redeposition{{"out", Angular::cosine, 20.0, {0.1}, {}}, Reemission::coned, {0.5}};
    const std::vector<Species> species{{"stick", 1.0, {1.0}}, {"low", 1.0, {0.1}}, ions};
    const double target = GENERATE(0.0, 0.2);
    // Rays for 16 batches, of less than a block and of several.
    const std::uint64_t rays = GENERATE(9'000u, 60'000u);
    const bool adjoint = GENERATE(false, true);
    const auto run = [&](const Shares& shares) {
        TraceOptions options{.rays = rays, .batches = 16, .adjoint = adjoint, .shares = shares};
        if (target > 0.0) options.relative_error = target;
        return trace_fluxes(t.mesh, t.scene, t.box, species, {}, t.wedges, options);
    };
    const std::vector<FluxResult> alone = run({});
    for (const std::uint32_t ranks : {2u, 3u, 5u})
        for (const std::vector<FluxResult>& shared : Team(ranks).each(run)) {
            CAPTURE(ranks);
            for (std::size_t k = 0; k < species.size(); ++k) check_same(alone[k], shared[k]);
        }
}

TEST_CASE("ranks that share a radiosity's rays all get the samples of one process") {
    const Trench t;
    const std::vector<double> sticking(t.wedges.count(), 0.2);
    const auto run = [&](const Shares& shares) {
        Exchange exchange(t.mesh, t.scene, t.box, t.wedges, {1.0}, {.shares = shares});
        exchange.gather(20'000);
        exchange.gather(5'000);
        const RadiosityFlux flux = solve_flux(exchange, {.sticking = sticking});
        return std::tuple(exchange.rays(), exchange.segments(), exchange.samples(), exchange.leaked(),
                          flux.wedge.flux, flux.wedge.error, flux.relative_error);
    };
    const auto alone = run({});
    for (const std::uint32_t ranks : {2u, 3u})
        for (const auto& shared : Team(ranks).each(run)) CHECK(shared == alone);
}

TEST_CASE("ranks agree on what the first one holds, and on whether all hold the same") {
    const auto agreed = Team(3).each([](const Shares& shares) {
        return std::array{of_first(shares, 7 + shares.rank), std::uint64_t{all_same(shares, 5)},
                          std::uint64_t{all_same(shares, shares.rank == 1 ? 5u : 6u)}};
    });
    for (const auto& one : agreed) CHECK(one == std::array<std::uint64_t, 3>{7, 1, 0});
    CHECK(of_first({}, 9) == 9);
    CHECK(all_same({}, 9));
}

TEST_CASE("a stop that ranks agree on ends the trace on all of them, and leaves none behind") {
    const Trench t;
    const auto ended = Team(2).each([&](const Shares& shares) {
        int sums = 0;  // after the second one all are asked to stop
        Shares counting = shares;
        counting.sum = [&](std::span<std::uint64_t> values) {
            shares.sum(values);
            ++sums;
        };
        TraceOptions options{.rays = 1'000'000, .shares = counting};
        options.relative_error = 1e-4;
        options.stop = [&] { return sums >= 2; };
        try {
            trace_flux(t.mesh, t.scene, t.box, {"low", 1.0, {0.1}}, {}, t.wedges, options);
        } catch (const Interrupted&) {
            return sums;
        }
        return 0;
    });
    CHECK(ended == std::vector{2, 2});
}
