# find_package(unrig) and link to unrig::unrig_core, unrig::unrig_fit or unrig::unrig_correct; each brings those below it.
include("${CMAKE_CURRENT_LIST_DIR}/libraries.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/unrigTargets.cmake")
