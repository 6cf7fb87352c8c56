#include "levelset/large_vector.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <utility>

namespace sidewall::levelset {
namespace {

// Bytes of a huge page, of which a grid needs few.
constexpr std::size_t kLargePage = std::size_t{1} << 21;
// Bytes; smaller blocks are left to malloc, which keeps them by itself.
constexpr std::size_t kLeastKept = 2 * kLargePage;

// Bytes of a block's header, which holds its size; 64 keep the data aligned for vector instructions.
constexpr std::size_t kHeader = 64;

// Rounds up by at most an eighth or a page, so that a block serves again when a grid has grown. Pages that
// are never touched take no memory.
std::size_t block_size(std::size_t bytes) {
    const std::size_t part = std::max(kLargePage, std::bit_floor(bytes) / 8);
    return (bytes + part - 1) / part * part;
}

void* behind_header(void* block, std::size_t size) {
    std::memcpy(block, &size, sizeof size);
    return static_cast<std::byte*>(block) + kHeader;
}

// The largest blocks that have been given back. Keeping more than four makes time steps no faster, but takes
// half as much memory again. A block more than twice as large as asked for is not taken.
class Kept {
  public:
    ~Kept() { drop(); }
    void drop() {
        const std::lock_guard lock(mutex_);
        for (Block& block : blocks_) std::free(std::exchange(block, Block{}).memory);
    }
    // nullptr if none is large enough.
    void* take(std::size_t size) {
        const std::lock_guard lock(mutex_);
        Block* best = nullptr;
        for (Block& block : blocks_)
            if (block.size >= size && block.size / 2 <= size && (best == nullptr || block.size < best->size))
                best = &block;
        if (best == nullptr) return nullptr;
        const Block taken = std::exchange(*best, Block{});
        return behind_header(taken.memory, taken.size);
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
    if (bytes < kLeastKept) {
        void* memory = std::malloc(std::max(bytes, std::size_t{1}));
        if (memory == nullptr) throw std::bad_alloc();
        return memory;
    }
    const std::size_t size = block_size(bytes + kHeader);
    if (void* memory = kept().take(size)) return memory;
    void* block = std::aligned_alloc(kLargePage, size);
    if (block == nullptr) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    madvise(block, size, MADV_HUGEPAGE);  // may fail without harm
#endif
    return behind_header(block, size);
}

void give_back_memory(void* memory, std::size_t bytes) {
    if (bytes < kLeastKept) return std::free(memory);
    void* block = static_cast<std::byte*>(memory) - kHeader;
    std::size_t size = 0;
    std::memcpy(&size, block, sizeof size);
    kept().keep(block, size);
}

void drop_kept_memory() {
    kept().drop();
}

}  // namespace sidewall::levelset
