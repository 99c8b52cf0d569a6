// Law files: a law that can be evaluated, or InputError.
#include <vector>

#include "core/files/error.h"
#include "core/law/law.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const unrig::Law law = unrig::parse_law(std::string(reinterpret_cast<const char*>(data), size), "law.toml");
    std::array<double, unrig::symbol_count> symbols{}, in_symbols{};
    symbols.fill(0.7);
    std::vector<double> start, partial(law.parameters.size());
    for (const unrig::Parameter& p : law.parameters) start.push_back(p.start);
    for (const unrig::Symbol s : {unrig::Symbol::a, unrig::Symbol::z})
      if (const auto split = law.force.linear_in(s)) split->rest(symbols.data(), start.data(), in_symbols.data(), partial.data());
    law.force(symbols.data(), start.data(), in_symbols.data(), partial.data());
    (void)law.kind();
  } catch (const unrig::InputError&) {
  }
  return 0;
}
