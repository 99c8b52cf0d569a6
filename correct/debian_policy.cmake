# What Debian asks of a package's files beyond their installation; run by cpack on those that it is going to pack: a changelog, and it and the manual page compressed.
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()
set(share ${CPACK_TEMPORARY_DIRECTORY}${CPACK_PACKAGING_INSTALL_PREFIX}/share)
set(ENV{LC_ALL} C)
string(TIMESTAMP day "%a, %d %b %Y %H:%M:%S +0000" UTC)  # or SOURCE_DATE_EPOCH
file(WRITE ${share}/doc/${CPACK_PACKAGE_NAME}/changelog "${CPACK_PACKAGE_NAME} (${CPACK_PACKAGE_VERSION}) unstable; urgency=medium\n\n  * Version ${CPACK_PACKAGE_VERSION}.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${day}\n")
execute_process(COMMAND gzip -9nf ${share}/doc/${CPACK_PACKAGE_NAME}/changelog ${share}/man/man1/${CPACK_PACKAGE_NAME}.1 COMMAND_ERROR_IS_FATAL ANY)
