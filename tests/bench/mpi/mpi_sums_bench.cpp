// Cost of a sum over the ranks: bytes, and seconds of the slowest rank in the fastest of several sums.
//   mpirun -n 2 build/release/bench/mpi_sums_bench
#include <mpi.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

int main() {
    MPI_Init(nullptr, nullptr);
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    for (std::size_t words = 1; words <= std::size_t{1} << 22; words *= 8) {
        std::vector<std::uint64_t> values(words, 1);
        double best = 1e9;
        for (int repeat = 0; repeat < 30; ++repeat) {
            MPI_Barrier(MPI_COMM_WORLD);
            double seconds = -MPI_Wtime();
            MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(words), MPI_UINT64_T, MPI_SUM,
                          MPI_COMM_WORLD);
            seconds += MPI_Wtime();
            MPI_Allreduce(MPI_IN_PLACE, &seconds, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
            best = std::min(best, seconds);
        }
        if (rank == 0) std::printf("%zu %.3g bytes, seconds\n", 8 * words, best);
    }
    MPI_Finalize();
}
