#pragma once
#include <cstdint>

namespace unrig {

/// Multiplications that this thread has made in small_product, triangularise, Householder and along nonlinear laws, with those of the threads that worked for it (in_parallel). For the same input the same number, however fast
/// the machine is and however many threads there are; of processors with AVX2 and without, whose products are rounded differently, nearly.
std::uint64_t work_done();

/// Of this thread.
namespace work {
extern constinit thread_local std::uint64_t done, most;
extern constinit thread_local bool lifted;
}  // namespace work

/// Adds to it.
inline void count_work(std::int64_t multiplications) { work::done += static_cast<std::uint64_t>(multiplications); }

}  // namespace unrig
