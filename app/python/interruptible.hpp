#pragma once
#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>

namespace sidewall::python {

/// Waits without the GIL until \p ready returns true. Python handles signals meanwhile: Ctrl-C sets \p stop,
/// and KeyboardInterrupt is raised once the work is ready.
/// \param ready  waits for at most the given time; true: the work is ready.
/// \pre the GIL is held.
inline void await(const std::function<bool(std::chrono::milliseconds)>& ready, std::atomic<bool>& stop) {
    constexpr std::chrono::milliseconds kPatience{50};
    const auto wait = [&] {
        const pybind11::gil_scoped_release released;
        return ready(kPatience);
    };
    while (!wait()) {
        if (PyErr_CheckSignals() == 0) continue;
        pybind11::error_already_set signal;
        stop = true;
        while (!wait()) {
        }
        throw signal;
    }
}

/// Runs \p work in another thread without the GIL and returns its result. \p work gets a function that says
/// whether it has to stop.
/// \throws what \p work throws; KeyboardInterrupt.
template <class Work>
auto interruptible(Work&& work) {
    std::atomic<bool> stop = false;
    auto result = std::async(std::launch::async, [&] { return work([&stop] { return stop.load(); }); });
    await([&](std::chrono::milliseconds time) { return result.wait_for(time) == std::future_status::ready; },
          stop);
    return result.get();
}

}  // namespace sidewall::python
