"""``/v1/uploads``: files of blades, sent ahead of a screening."""

from __future__ import annotations

import anyio
from anyio import to_thread
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from service.jobs.durable_files import is_full
from service.jobs.errors import NoRoom
from service.jobs.screening.looking import Contents, contents
from service.jobs.uploads import FORMS
from service.rest.access import SUBMIT, Caller, the_caller
from service.rest.forms.media_types import body_form
from service.rest.job_schemas import JobFault, UploadReply
from service.rest.known_query import KNOWN_QUERY
from service.rest.limits import SlowBody
from service.rest.openapi import problems
from service.rest.routes.jobs import the_jobs
from service.rest.routes.request import the_desk
from service.roles import Role
from service.sizes import check_length

router = APIRouter(prefix="/v1/uploads", tags=["screenings"], dependencies=[SUBMIT, KNOWN_QUERY])
_UNNAMED = "upload"
_FILE = {"schema": {"type": "string", "format": "binary"}}


def owner_of(caller: Caller) -> str | None:
    """Whose uploads a caller may use; None: everybody's."""
    return None if caller.role is Role.admin else caller.key_id


@router.post(
    "",
    status_code=201,
    response_model=UploadReply,
    openapi_extra={"requestBody": {"required": True, "content": dict.fromkeys(FORMS, _FILE)}},
    responses=problems(408, 413, 415, 422, 500, 503, 507),
)
async def send_file(request: Request, name: str = _UNNAMED) -> UploadReply:
    """Send blade files or profiles: one or a list as JSON, one a line (NDJSON), or *.json in a zip.

    It is read to its end before it is answered: what is no JSON, no whole zip, or has no blade in it is
    refused, by line or member, and not kept. The first blade that cannot be used is told as `fault`.

    All files of one key together take up at most `max_uploads_bytes`; the same file sent again counts once.
    One too many is answered 507 (type `urn:rubscreen:problem:upload-quota`); `uploads` lists the largest.
    """
    desk, service = the_jobs(request), the_desk(request)
    settings = service.settings
    form = body_form(request.headers.get("content-type"), FORMS)
    check_length("name", name, settings.max_name_length, "shorten it")
    announced = request.headers.get("content-length", "")
    size = int(announced) if announced.isdecimal() else 0
    owner = the_caller(request).key_id
    writer = await to_thread.run_sync(desk.uploads.begin, size, owner)
    try:
        # As much time for each part of it as a whole body has.
        stream = request.stream()
        while True:
            try:
                with anyio.fail_after(settings.body_timeout_s):
                    part = await anext(stream, None)
            except TimeoutError:
                found = f"nothing for {settings.body_timeout_s:g} s"
                raise SlowBody("body", found, "send the file without pauses") from None
            if part is None:
                break
            if part:
                await to_thread.run_sync(writer.write, part)
        upload = await to_thread.run_sync(writer.whole, name, form)

        def looked_at() -> Contents:
            return contents(name, writer.documents(upload, settings.max_job_blades), settings)

        # Whose file has come is not turned away for want of a place in the queue: sending it takes long.
        seen = await service.work.run(looked_at, request, turn_away=False)
        await to_thread.run_sync(writer.keep, upload)
    except BaseException as error:
        with anyio.CancelScope(shield=True):
            await to_thread.run_sync(writer.abandon)
        if isinstance(error, OSError) and is_full(error):
            raise NoRoom("data_folder", "full", "make room on the disk of the service") from None
        raise
    fault = seen.fault
    return UploadReply(
        id=upload.id,
        name=upload.name,
        form=upload.form,
        size_bytes=upload.size_bytes,
        sha256=upload.sha256,
        blades=seen.blades,
        fault=None if fault is None else JobFault(field=fault.field, value=fault.value, remedy=fault.remedy),
    )


@router.delete("/{upload_id}", status_code=204, responses=problems(404, 500, 503))
def delete_file(request: Request, upload_id: str) -> Response:
    """Delete a file; screenings made of it keep what they need."""
    the_jobs(request).uploads.remove(upload_id, owner_of(the_caller(request)))
    return Response(status_code=204)
