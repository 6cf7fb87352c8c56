#include "flux/radiosity/exchange_state.hpp"

#include <tbb/task_arena.h>

#include <bit>
#include <utility>

namespace sidewall::flux {

double Exchange::State::scale(std::uint32_t bits) const {
    return 1.0 / (static_cast<double>(group_rays) * std::popcount(bits));
}

const BalancedSamples& Exchange::State::balanced(std::uint32_t bits) const {
    const std::lock_guard lock(mutex_);
    const auto found = balanced_.find(bits);
    if (found != balanced_.end()) return found->second;
    std::vector<const SampleGroup*> chosen;
    for (std::size_t g = 0; g < groups.size(); ++g)
        if ((bits >> g & 1u) != 0) chosen.push_back(&groups[g]);
    // Isolated: while it waits for its own tasks, this thread must not take one that comes here, too.
    const auto make = [&] {
        return balanced_.try_emplace(bits, profile.unknowns, std::move(chosen), scale(bits)).first;
    };
    return tbb::this_task_arena::isolate(make)->second;
}

}  // namespace sidewall::flux
