/** Page to Worker: the newest state has been taken. */
export const TAKEN = 0;
