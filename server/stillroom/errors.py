"""Every error of the domain. Nothing here knows HTTP: `stillroom.api` maps each class to a status."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input: `pointer` is a JSON pointer (RFC 6901) into it."""

    pointer: str
    detail: str


class StillroomError(Exception):
    """Base of all errors that a caller can act on.

    `slug` names the kind of error for ever (it becomes the problem's `type`), `title` says it in words,
    `extra` holds further members for the answer.
    """

    slug = "error"
    title = "Error"
    retryable = False

    def __init__(self, detail: str, faults: tuple[Fault, ...] = (), **extra: object) -> None:
        super().__init__(detail)
        self.detail = detail
        self.faults = faults
        self.extra = extra


class InvalidInput(StillroomError):
    slug = "invalid-input"
    title = "The input can't be used"


class InvalidGrid(InvalidInput):
    slug = "invalid-grid"
    title = "The grid can't be read"


class InvalidEdit(InvalidInput):
    slug = "invalid-edit"
    title = "The edit can't be applied"


class TooLarge(StillroomError):
    slug = "too-large"
    title = "Larger than the limit"


class UnsupportedFormat(StillroomError):
    slug = "unsupported-format"
    title = "A format that is not read here"


class NotFound(StillroomError):
    slug = "not-found"
    title = "There is no such thing"


class AlreadyExists(StillroomError):
    slug = "already-exists"
    title = "It exists already"


class MissionConflict(StillroomError):
    slug = "mission-conflict"
    title = "Another mission has this id"


class AlreadyDecided(StillroomError):
    """Somebody has decided otherwise before; `decided_by` and `decided_at` say who and when."""

    slug = "already-decided"
    title = "It was decided already"


class ChangedSince(StillroomError):
    """It can't be taken back, because the same was changed again."""

    slug = "changed-since"
    title = "It was changed again since"


class ProposalOutdated(StillroomError):
    """The map has changed since it was proposed, and the proposal does not fit it any more."""

    slug = "proposal-outdated"
    title = "The proposal does not fit the map any more"


class NotParked(StillroomError):
    slug = "not-parked"
    title = "The mission is not parked"


class NotUnprocessed(StillroomError):
    slug = "not-unprocessed"
    title = "The mission was processed"


class NotRunning(StillroomError):
    """A rollout can't be led on, ended or taken back as it stands."""

    slug = "not-running"
    title = "The rollout is in another state"


class GateNotPassed(StillroomError):
    """A rollout does not go on by what its missions came to; `verdict` says how they were judged last."""

    slug = "gate-not-passed"
    title = "The rollout's gates are not passed"


class PreconditionRequired(StillroomError):
    slug = "precondition-required"
    title = "If-Match is required"


class StaleVersion(StillroomError):
    slug = "stale-version"
    title = "The map has a newer version"


class Unauthenticated(StillroomError):
    slug = "unauthenticated"
    title = "A valid credential is required"


class Forbidden(StillroomError):
    slug = "forbidden"
    title = "Not allowed for this caller"


class GrantRequired(Forbidden):
    """A floor plan is looked at with its owner's leave alone; `plan` says whether that was asked for."""

    slug = "grant-required"
    title = "The owner has not agreed to this"


class Unavailable(StillroomError):
    """The service can't do this now; `retry_after_s` says when to try again."""

    slug = "unavailable"
    title = "Not available now"
    retryable = True

    def __init__(self, detail: str, retry_after_s: int = 5) -> None:
        super().__init__(detail)
        self.retry_after_s = retry_after_s


class TooMany(Unavailable):
    """The caller has asked for this too often; `retry_after_s` says when to try again."""

    slug = "too-many"
    title = "Asked too often"
