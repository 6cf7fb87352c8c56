// The program's calls of MPI, in a separate library. Only processes that mpirun has started load it
// (common/processes.cpp), so the program itself runs without MPI.
#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

extern "C" {

void sidewall_mpi_join(int* rank, int* ranks) {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, rank);
    MPI_Comm_size(MPI_COMM_WORLD, ranks);
}

void sidewall_mpi_sum(std::uint64_t* values, std::size_t count) {
    constexpr std::size_t kMost = std::size_t{1} << 26;  // values a call; MPI counts in int
    for (std::size_t first = 0; first < count; first += kMost)
        MPI_Allreduce(MPI_IN_PLACE, values + first, static_cast<int>(std::min(kMost, count - first)),
                      MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
}

void sidewall_mpi_abort(int exit_code) {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
}

void sidewall_mpi_leave() {
    MPI_Finalize();
}

}  // extern "C"
