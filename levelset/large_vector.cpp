#include "levelset/large_vector.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <new>
#include <utility>

namespace sidewall::levelset {
namespace {

// Pages of this size are asked for, in which a grid needs few.
constexpr std::size_t kLargePage = std::size_t{1} << 21;
// Less than this malloc keeps by itself.
constexpr std::size_t kLeastKept = 2 * kLargePage;

std::size_t whole_pages(std::size_t bytes) {
    return (bytes + kLargePage - 1) / kLargePage * kLargePage;
}

// What has been given back, the largest blocks of a time step: more of them make it no faster, but take a
// half more memory. A block is not taken for what half of it would do for.
class Kept {
  public:
    ~Kept() { drop(); }
    void drop() {
        const std::lock_guard lock(mutex_);
        for (Block& block : blocks_) std::free(std::exchange(block, Block{}).memory);
    }
    void* take(std::size_t size) {
        const std::lock_guard lock(mutex_);
        Block* best = nullptr;
        for (Block& block : blocks_)
            if (block.size >= size && block.size / 2 <= size && (best == nullptr || block.size < best->size))
                best = &block;
        return best ? std::exchange(*best, Block{}).memory : nullptr;
    }
    void keep(void* memory, std::size_t size) {
        Block block{memory, size};
        {
            const std::lock_guard lock(mutex_);
            const auto least =
                std::min_element(blocks_.begin(), blocks_.end(),
                                 [](const Block& a, const Block& b) { return a.size < b.size; });
            if (least->size < block.size) std::swap(*least, block);
        }
        std::free(block.memory);
    }

  private:
    struct Block {
        void* memory = nullptr;
        std::size_t size = 0;
    };
    std::mutex mutex_;
    std::array<Block, 4> blocks_;
};

Kept& kept() {
    static Kept blocks;
    return blocks;
}

}  // namespace

void* take_memory(std::size_t bytes) {
    void* memory = nullptr;
    if (bytes < kLeastKept) {
        memory = std::malloc(std::max(bytes, std::size_t{1}));
    } else {
        const std::size_t size = whole_pages(bytes);
        memory = kept().take(size);
        if (memory != nullptr) return memory;
        memory = std::aligned_alloc(kLargePage, size);
#ifdef MADV_HUGEPAGE
        if (memory != nullptr) madvise(memory, size, MADV_HUGEPAGE);  // in vain is no harm
#endif
    }
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

void give_back_memory(void* memory, std::size_t bytes) {
    if (bytes < kLeastKept)
        std::free(memory);
    else
        kept().keep(memory, whole_pages(bytes));
}

void drop_kept_memory() {
    kept().drop();
}

}  // namespace sidewall::levelset
