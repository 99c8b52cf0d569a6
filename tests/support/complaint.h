#pragma once
#include <string>

#include "core/files/error.h"

namespace unrig::test {

/// What a call has against its input; "nothing" where it goes through.
template <class Call>
std::string complaint(Call call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "nothing";
}

}  // namespace unrig::test
