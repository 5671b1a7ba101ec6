//! Label files: what belongs to which photo, groups, holes, other formats.
