#pragma once
#include <Random123/philox.h>

#include <array>
#include <cstdint>

namespace sidewall::flux {

/// Names one stream of random numbers: a species in a time step of a run.
using RandomKey = r123::Philox4x32::key_type;

/// The key of (seed, step, species). Philox itself spreads the 128 bits over the 64 of the key.
inline RandomKey random_key(std::uint64_t seed, std::uint32_t step, std::uint32_t species) {
    const auto low = static_cast<std::uint32_t>(seed), high = static_cast<std::uint32_t>(seed >> 32);
    const auto mixed = r123::Philox4x32{}({{low, high, step, species}}, {{0x51de3a11u, 0xf10cu}});
    return {{mixed[0], mixed[1]}};
}

/// The four random words that belong to one event of one particle.
struct Draws {
    std::array<std::uint32_t, 4> word;
    /// Uniform in the open interval (0, 1): the centres of 2^32 equal cells.
    double uniform(std::size_t i) const { return (word[i] + 0.5) * 0x1p-32; }
};

/// The words of (\p ray, \p bounce) under \p key: bounce 0 is the emission from the source. Counter based
/// (Salmon et al., SC 2011, Philox4x32-10): any thread may ask for any event in any order and gets the same
/// words.
inline Draws draw(RandomKey key, std::uint64_t ray, std::uint32_t bounce) {
    const auto low = static_cast<std::uint32_t>(ray), high = static_cast<std::uint32_t>(ray >> 32);
    const auto words = r123::Philox4x32{}({{low, high, bounce, 0u}}, key);
    return {{words[0], words[1], words[2], words[3]}};
}

}  // namespace sidewall::flux
