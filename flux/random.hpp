#pragma once
#include <Random123/philox.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace sidewall::flux {

/// The key of one stream of random numbers: a species in a time step of a run.
using RandomKey = r123::Philox4x32::key_type;

/// The key of (seed, time step, species). Philox itself hashes these 128 bits into the 64 of the key.
inline RandomKey random_key(std::uint64_t seed, std::uint32_t time_step, std::uint32_t species) {
    const auto low = static_cast<std::uint32_t>(seed), high = static_cast<std::uint32_t>(seed >> 32);
    const auto mixed = r123::Philox4x32{}({{low, high, time_step, species}}, {{0x51de3a11u, 0xf10cu}});
    return {{mixed[0], mixed[1]}};
}

/// 32 random bits as a number in the open interval (0, 1): the centres of 2^32 equal cells.
inline double unit_double(std::uint32_t word) {
    return (word + 0.5) * 0x1p-32;
}

/// The four random words that belong to one event of one particle.
struct Draws {
    std::array<std::uint32_t, 4> word;
    double uniform(std::size_t i) const { return unit_double(word[i]); }
};

/// The words of (\p ray, \p bounce) under \p key; bounce 0 is the emission from the source. Counter based
/// (Salmon et al., SC 2011, Philox4x32-10): an event has the same words on any thread and in any order.
inline Draws draw(RandomKey key, std::uint64_t ray, std::uint32_t bounce) {
    const auto low = static_cast<std::uint32_t>(ray), high = static_cast<std::uint32_t>(ray >> 32);
    const auto words = r123::Philox4x32{}({{low, high, bounce, 0u}}, key);
    return {{words[0], words[1], words[2], words[3]}};
}

/// Identifies an event of a particle. Bounce 0 is the emission. Particles from the source are generation 0;
/// those that a hit of bounce b sputters are generation b.
struct Event {
    std::uint32_t ray = 0, batch = 0, bounce = 0, generation = 0;
};

/// A sequence of random numbers for one event; for generation 0 the first four are those of draw().
class Stream {
  public:
    Stream(RandomKey key, Event event) : key_(key), event_(event) {}
    double uniform() { return unit_double(next()); }
    std::uint32_t next() {
        if (used_ == 4) {
            // Block number in the upper 12 bits, generation in the lower 20: rejection loops take few blocks.
            const std::uint32_t last = event_.generation + (block_++ << 20);
            words_ = r123::Philox4x32{}({{event_.ray, event_.batch, event_.bounce, last}}, key_);
            used_ = 0;
        }
        return words_[used_++];
    }

  private:
    RandomKey key_;
    Event event_;
    r123::Philox4x32::ctr_type words_{};
    std::uint32_t used_ = 4, block_ = 0;
};

/// Philox's two multipliers for eight lanes. Defined in random.cpp, because a compiler that sees their values
/// turns the products into shifts and sums, which is twice as slow.
extern const std::uint64_t kMultiplier[2][8];

/// draw() for eight rays at once, with the same words in each lane. The loops over lanes vectorise: they work
/// in 64 bits, the width of the products, so that no lanes are shuffled.
/// \param words  four rows of eight.
inline void draw8(RandomKey key, const std::uint32_t* ray, Event event, std::uint32_t words[4][8]) {
    const auto low = [](std::uint64_t word) { return static_cast<std::uint32_t>(word); };
    alignas(32) std::uint64_t a[8], b[8], c[8], d[8];
    for (int i = 0; i < 8; ++i) {
        a[i] = ray[i];
        b[i] = event.batch;
        c[i] = event.bounce;
        d[i] = event.generation;
    }
    std::uint32_t k0 = key[0], k1 = key[1];
    for (int round = 0; round < 10; ++round) {
        for (int i = 0; i < 8; ++i) {
            const std::uint64_t p = std::uint64_t{low(a[i])} * low(kMultiplier[0][i]),
                                q = std::uint64_t{low(c[i])} * low(kMultiplier[1][i]);
            a[i] = q >> 32 ^ b[i] ^ k0;
            b[i] = low(q);
            c[i] = p >> 32 ^ d[i] ^ k1;
            d[i] = low(p);
        }
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
    for (int i = 0; i < 8; ++i) {
        words[0][i] = low(a[i]);
        words[1][i] = low(b[i]);
        words[2][i] = low(c[i]);
        words[3][i] = low(d[i]);
    }
}

}  // namespace sidewall::flux
