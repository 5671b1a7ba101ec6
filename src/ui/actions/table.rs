//! The table of actions. A row holds an action's name on screen, one sentence on its effect, its key if it has one, and
//! what it does.

/// Hands the table to the macro `$to`: the actions and their texts are made of it in [`super`], what they do in
/// [`crate::ui::act`].
macro_rules! action_table {
    ($to:ident) => {
        $to! {
            |app, ctx|
            OpenFolder: "Open folder\u{2026}",
                "COLMAP, transforms.json (nerfstudio, instant-ngp, Blender), LLFF, or a trained scene.", "Ctrl+O"
                => open::choose_folder(app);
            OpenFile: "Open file\u{2026}", "A splat (.ply, .sog, .gltf, .glb), a transforms.json, or the scene.json of a trained scene."
                => open::choose_file(app);
            Open(path: PathBuf): format!("Open {}", path.display()), "Open this path." => open::open(app, path);
            OpenLast: "Open the last scene", "The scene or data set that was open most recently." => runs::open_last(app);
            FindPoses(request: Box<PoseRequest>): format!("Find the camera poses of {}", request.photos.folder.display()),
                "Find them in a folder of their own, and open the result." => open::find_poses(app, request);
            Connect(url: String): "Connect to another computer",
                "Look at what 'fmlgs serve' or 'fmlgs train --serve' shows there." => remote::connect(app, &url);
            OpenDemo: "Open the demo", "A trained tabletop with objects and parts, ready for queries. No download needed."
                => open::demo(app);
            TrainDemo: "Train the demo yourself",
                "Render posed photos of the tabletop and train on them. No download needed." => open::demo_photos(app);
            ExportPly: "Export Gaussians\u{2026}", "Write the Gaussians as .ply, .spz, .sog, .glb or others that viewers read.", "Ctrl+E"
                => gaussians::all(app);
            ExportAll: "Export all objects and parts\u{2026}",
                "Into a folder: a .ply each, and their masks in the photos as ISAT, COCO and id pictures."
                => export::all_objects(app);
            ExportPage: "Export page\u{2026}",
                "One .html that opens in any browser without a server: to orbit, with names to click and camera paths."
                => export::page(app);
            SaveCopy: "Save a copy of the scene\u{2026}",
                "Copy its folder to another place: Gaussians, objects, settings, camera paths, measurements."
                => runs::save_copy(app);
            ShowFolder(of: Option<PathBuf>): of.as_ref().map_or_else(|| "Show the scene in its folder".into(),
                    |p| format!("Show {} in its folder", p.display())), "Open the folder in the system's file manager."
                => runs::show_folder(app, ctx, of);
            RenameRun(run: PathBuf, name: String): format!("Rename the training to {name}"),
                "Give the training another name; its folder stays where it is." => runs::rename(app, run, name);
            DeleteRun(run: PathBuf): format!("Delete the training {}\u{2026}", run.display()),
                "Delete this training with its Gaussians and objects. The photos and the other trainings stay."
                => runs::ask_to_delete(app, run);
            Screenshot: "Save the view as .png\u{2026}", "Write the image in the viewport, without the drawn cameras.", "Ctrl+S"
                => export::screenshot(app);
            StartTraining: "Start training",
                "Fit Gaussians to the photos. Resumes from the last checkpoint if the settings are the same.", "Ctrl+T"
                => train::start(app, false, IfChanged::Ask);
            TrainAnew: "Begin training anew",
                "Another training of the same photos, in a folder of its own. The one before stays, and its objects are carried over."
                => train::start(app, true, IfChanged::Ask);
            PauseJob: "Pause or resume the running job", "Training, a search for objects, a download: it waits and loses nothing.", "T"
                => train::pause(app);
            Cancel: "Stop the running job", "Cancel it at its next step. Progress so far is kept."
                => remote::cancel_job(app);
            Dismiss: "Deselect, or stop the running job", "Deselect what is selected; with nothing selected, ask whether to stop the running job.",
                "Escape" => view::dismiss(app, ctx);
            Evaluate: "Evaluate on held-out photos", "PSNR and SSIM on photos held out from training."
                => train::evaluate(app);
            FindObjects: "Find objects and parts",
                "From the labels that came with the photos, or else from what networks or colors tell."
                => objects::find(app);
            SegmentPhoto: "Add from this photo",
                "Find objects that this photo, or else the nearest one, shows and that are not known yet. Objects and parts stay; can be undone."
                => objects::segment_photo(app);
            ChooseMasks: "Find objects with other masks\u{2026}",
                "Labels of ISAT, LabelMe, COCO, YOLO, fmlgs synth, SPIn-NeRF, 3D-OVS, LERF-Mask or Ref-LERF, or LangSplat's language_features; one labeled photo is enough."
                => objects::choose_masks(app);
            FetchModel(id: String): format!("Download the model {id}"), "Download it, verify it, and use it from then on."
                => objects::install_model(app, id, None);
            AddModel(id: String): format!("Add files of the model {id}\u{2026}"),
                "Choose a folder with its files; they are verified and copied." => objects::choose_model_files(app, id);
            TypeQuery: "Query an object or a part", "A name, or \"the button of the red controller\".", "/"
                => query::type_query(app, ctx);
            Ask(text: String): format!("Query {text}"), "A name, or \"the button of the red controller\"."
                => query::ask(app, &text);
            RunPhrases(to: Option<PathBuf>): to.as_ref().map_or_else(|| "Run the phrase list".into(),
                    |to| format!("Export phrase masks to {}", to.display())),
                "Query every phrase of the list, in this view or in all photos." => query::run_phrases(app, to);
            ExportPhrases: "Export phrase masks\u{2026}", "As .png, COCO .json and a .csv table, in a folder."
                => query::choose_phrases_folder(app);
            ChooseTrueMask: "Compare with a true mask\u{2026}",
                "A .png of this view, white where the object is. Shows hits, misses, false alarms and IoU."
                => query::choose_true_mask(app);
            TrueMask(path: Option<PathBuf>): path.as_ref().map_or_else(|| "End the comparison with a true mask".into(),
                    |p| format!("Compare with the true mask {}", p.display())),
                "Hits, misses, false alarms and IoU of the latest answer."
                => query::compare_with_mask(app, path.as_deref());
            PaintTrueMask: "Paint a true mask", "Paint what the answer should be here: shows hits, misses, false alarms, IoU."
                => app.viewport.paint_true_mask(&app.state);
            SaveTrueMask: "Save the true mask as .png\u{2026}", "White where the object is; can be loaded again."
                => query::save_true_mask(app);
            GoToTarget(id: IdentityId, side: Side): format!("Go to #{id}, {}", side.text()),
                "Fly to its best view, around obstacles." => view::go_to(app, id, side);
            PlayPath: "Play or pause the camera path", "Fly along the path, or pause where you are.", "Space"
                => view::play_path(app);
            StepBack: "Previous frame", "Move back along the path by one frame.", "," => view::step_in_time(app, ctx, -1.0);
            StepForward: "Next frame", "Move forward along the path by one frame.", "."
                => view::step_in_time(app, ctx, 1.0);
            AddKey: "Add keyframe", "Add the current view to the camera path: at the playhead, or else at the end.", "K"
                => view::add_key(app);
            Turntable(of: Option<IdentityId>): "Turntable around the selection",
                "Replace the camera path by a turn around the selection, or else the scene, and play it."
                => view::turntable(app, of);
            OpenPath: "Open a camera path\u{2026}", "A path of this program, or of nerfstudio's viewer."
                => open::choose_path(app);
            SavePath: "Save the camera path\u{2026}", "As .json; for nerfstudio, end its name in .nerfstudio.json."
                => export::camera_path(app);
            ExportVideo: "Export video\u{2026}", "H.264 (.mp4), .gif, .webp, or .png frames in a folder."
                => export::video(app);
            StartChat: "Chat", "Type a command, such as \u{201c}show me the lid of the kettle\u{201d}. \u{201c}help\u{201d} lists all.", "Enter"
                => query::start_chat(app);
            SaveChat: "Save conversation\u{2026}", "As Markdown, or .json, with every step and its result."
                => export::conversation(app);
            Select(id: Option<IdentityId>): id.map_or_else(|| "Deselect".into(), |id| format!("Select #{id}")),
                "Outline it in the view; keys and menus act on it." => app.viewport.picking.select(id);
            SelectNext: "Select the next object", "In the order of the list; with a part selected, the part next to it.", "N"
                => view::select_sibling(app, false);
            SelectPrevious: "Select the previous object", "In the order of the list; with a part selected, the part before it.", "P"
                => view::select_sibling(app, true);
            SelectInner: "Select a part of the selection", "The first part of what is selected; N and P go through the others.", "O"
                => view::select_part(app);
            SelectOuter: "Select the whole of the selection", "What the selected part is a part of.", "U"
                => view::select_whole(app);
            IsolateSelected: "Isolate the selection",
                "Show only the selection, or everything again.", "I" => view::isolate_selected(app);
            HideSelected: "Hide the selection", "Do not show it in the view.", "H" => view::hide_selected(app);
            GoToSelected: "Go to the selection", "Fly to its best view.", "G" => view::go_to_selected(app);
            Isolate(only: Option<IdentityId>): only.map_or_else(|| "Show all objects".into(), |id| format!("Show only #{id}")),
                "Show everything that was hidden." => view::isolate(app, only);
            Hide(id: IdentityId): format!("Hide or show #{id}"), "Hide it in the view, or show it again."
                => view::hide(app, id);
            ExportTarget(id: IdentityId): format!("Export #{id}\u{2026}"),
                "Write its Gaussians in the format that 3DGS viewers read." => gaussians::identity(app, id);
            Remove(id: IdentityId): format!("Remove #{id} and fill"),
                "Make a copy of the scene without it, shown beside this one. What it hid is filled from what is around."
                => objects::remove(app, &[id]);
            AnotherFill(request: Box<RemoveRequest>): "Another fill",
                "Remove it again, with another choice of what hides below it; the scene made before stays."
                => objects::submit_removal(app, *request);
            DeleteRemoved: "Delete this scene\u{2026}",
                "Delete the scene of a removal that is shown beside this one; without one, the open scene."
                => objects::ask_to_delete_removed(app);
            Transform(id: IdentityId): format!("Transform #{id}"),
                "Drag it along the axes, turn, scale, duplicate or recolor it; can be undone." => edit::transform(app, id);
            ApplyTransform: "Apply the transform", "Carry out what the view shows of a moved, duplicated or recolored thing."
                => edit::apply_transform(app);
            MeasureSplats: "Clean up\u{2026}",
                "Size, shape, opacity and neighbors of each, and what the photos show of it: finds floaters and the like."
                => edit::measure_splats(app);
            SelectBy(shape: SelectShape): format!("Select Gaussians by {shape}"),
                "In any view; to keep them as an object or part, to delete or to export them."
                => app.viewport.select_with(shape, &app.state);
            NarrowLine: "Narrower line", "Make the lines of the selection tool thinner, or its brush and ball smaller.", "-"
                => edit::widen_line(app, false);
            WidenLine: "Wider line", "Make the lines of the selection tool thicker, or its brush and ball larger.", "="
                => edit::widen_line(app, true);
            RefineChosen: "Go on selecting by hand", "Brush, lasso and more, from the selection of the Clean pane on."
                => edit::refine_chosen(app);
            DeleteChosen: "Delete the selected Gaussians",
                "Those that are outlined, or selected in the Clean pane; can be undone, and the scene that was opened stays as it is."
                => edit::delete_chosen(app);
            ExportSelection: "Export the selected Gaussians\u{2026}", "Write the selection in the format that 3DGS viewers read."
                => gaussians::selection(app);
            ExportCrop: "Export what the crop box keeps\u{2026}",
                "Write the Gaussians whose centers it keeps, hidden ones too, in the format that 3DGS viewers read."
                => gaussians::crop(app);
            Change(edit: Edit): match edit {
                    Edit::Rename(_, name) => format!("Rename to {name}"),
                    Edit::Merge(from, into) => format!("Merge #{from} into #{into}"),
                    Edit::Split(id) => format!("Split #{id}"),
                    Edit::Dissolve(id) => format!("Dissolve #{id}"),
                    Edit::AddPiece { name, .. } => format!("Add {name}"),
                    Edit::Reshape { id, .. } => format!("Correct the extent of #{id}"),
                }, "Correct the segmentation; can be undone." => edit::apply(app, edit);
            SegmentNew(of: Option<IdentityId>): match *of {
                    None => "Stop selecting by clicks".into(),
                    Some(NO_IDENTITY) => "New object".to_owned(),
                    Some(id) => format!("New part of #{id}"),
                }, "Click on it or draw a line through it, in any view; name it, and it can be asked for everywhere."
                => edit::segment(app, of);
            Correct(id: IdentityId): format!("Correct #{id} by clicks"),
                "Add what it lacks and remove what it has too much, by clicks and lines in any view."
                => edit::correct(app, id);
            AddPainted: "Keep the selection", "Make what is selected an object or part, or the extent of the one that is corrected."
                => edit::add_segment(app);
            RenameThis(id: IdentityId): format!("Rename #{id}"), "Type a new name."
                => { app.viewport.picking.select(Some(id)); edit::start_renaming(app) };
            Rename: "Rename", "Type a new name for the selected object or part.", "F2" => edit::start_renaming(app);
            Undo: "Undo", "Undo the last change to objects, visibility or the camera path.", "Ctrl+Z"
                => edits::queue(app, EditStep::Undo);
            Redo: "Redo", "Redo the last undone change.", "Ctrl+Y" => edits::queue(app, EditStep::Redo);
            FrameScene: "Frame the selection or the scene", "Move until the selection, or the whole scene, fits the view.", "F"
                => view::frame(app, ctx);
            ResetView: "Reset the view", "Return to the scene's initial view.", "Home" => view::reset(app, ctx);
            LookFrom(face: Face): format!("Look from the {}", <&str>::from(face)),
                "Straight and without perspective, at the selection or the whole scene."
                => view::look_from(app, ctx, face);
            Orthographic: "Orthographic view", "Parallel lines stay parallel: to compare sizes and to measure. Again for perspective.", "Y"
                => view::toggle_orthographic(app, ctx);
            TurnUp(axis: Axis): format!("Make {} the up direction", axis.text()), "For scenes that lie on their side."
                => view::turn_up(app, ctx, axis.vector());
            SetUp(up: DVec3): format!("Make ({:.2}, {:.2}, {:.2}) the up direction", up.x, up.y, up.z),
                "Use the picked plane as the floor." => view::turn_up(app, ctx, up);
            Measure: "Measure", "Lengths, angles, areas and boxes of objects; the scale from a known length, the floor from a plane.", "M"
                => app.viewport.measure(&app.state);
            KeepMeasurement: "Keep the measurement", "Give it a name and store it with the scene." => measure::keep(app);
            ExportMeasurements: "Export measurements\u{2026}", "As a .csv table, or as .json with their points."
                => measure::write(app);
            Crop: "Crop box", "Show only the Gaussians in a box: drag its faces or type its corners.", "B"
                => app.viewport.crop(&app.state);
            SetCrop(crop: Option<CropBox>): if crop.is_some() { "Crop the view" } else { "Remove the crop box" },
                "Show only what a box keeps, or everything again." => view::set_crop(app, crop);
            Inspect: "Inspect Gaussians", "Click a pixel to see every property of its Gaussians.", "X"
                => app.viewport.inspect(&app.state, &app.tasks);
            InspectAt(at: DVec2): format!("Inspect the Gaussians at ({:.2}, {:.2})", at.x, at.y),
                "Every property of the Gaussians of a pixel." => app.viewport.inspect_at(at, &app.state, &app.tasks);
            SetScale(meters: f64): format!("Set the scale to {meters} m per unit"),
                "Show lengths in meters; saved with the scene." => edit::set_scale(app, meters);
            PreviousPhoto: "Previous photo", "Look through the camera of the previous photo.", "["
                => view::step_photo(app, ctx, -1);
            NextPhoto: "Next photo", "Look through the camera of the next photo.", "]" => view::step_photo(app, ctx, 1);
            GoToPhoto(index: usize): format!("Go to photo {}", index + 1), "Look through the camera of this photo."
                => view::go_to_photo(app, ctx, index);
            Show(mode: ViewMode): match mode {
                    ViewMode::Rgb => "Show RGB".to_owned(),
                    other => format!("Show {}", other.text().to_lowercase()),
                }, "Choose what the viewport shows. With Shift, over the colors that are shown." => view::show(app, ctx, mode);
            Tint(by: ColorBy): format!("Color by {}", by.text().to_lowercase()),
                "Color the view this way; again for the RGB image. With Shift, whatever is shown."
                => view::tint(app, ctx, by);
            ToggleCompare: "Compare with the photo", "Show the photo beside the rendering with a slider between them.", "C"
                => view::toggle_compare(app, ctx);
            ChoosePhoto: "Locate a photo\u{2026}",
                "Find where a photo was taken that nobody posed, go there and compare it with the scene. Dropping it on the view does the same."
                => locate::choose(app);
            LocatePhotos(paths: Vec<PathBuf>): match paths.as_slice() {
                    [one] => format!("Locate {}", one.display()),
                    all => format!("Locate {} photos", all.len()),
                },
                "Find where they were taken, go there and compare them with the scene." => locate::start(app, paths);
            AddFolder: "Add photos\u{2026}",
                "Train a better scene from this one and a folder of new photos, with or without poses. This one stays as it is."
                => add::choose_folder(app);
            AddPhoto: "Add a photo\u{2026}",
                "Train a better scene from this one and a new photo, or a list of posed ones. This one stays as it is."
                => add::choose_photo(app);
            AddPhotos(photos: Vec<PathBuf>): match photos.as_slice() {
                    [one] => format!("Add {} to the scene", one.display()),
                    all => format!("Add {} photos to the scene", all.len()),
                },
                "Train a better scene from this one and these photos. This one stays as it is." => add::start(app, photos);
            OfferPhotos(folder: PathBuf): format!("Add or open {}", folder.display()),
                "Add the folder's photos to the scene, or open it." => add::offer(app, folder);
            SavePose: "Save its pose\u{2026}",
                "Write the camera of the located photo as a transforms.json beside it." => locate::save_pose(app);
            ForgetPhoto: "Remove the located photo",
                "Take it off the list; its file stays." => locate::forget(app);
            ToggleSplit: "Split view", "Two views of the scene by one camera, each with its own query and colors.", "8"
                => view::toggle_split(app);
            OtherView: "Switch view", "Keys, queries and colors act on it from now on.", "0"
                => view::other_view(app);
            ChooseComparison: "Open to compare\u{2026}",
                "Show another scene, or the result of another method, beside this one by the same camera; up to four."
                => comparing::choose(app);
            OpenComparison(path: PathBuf): format!("Compare with {}", path.display()), "Show it beside this scene."
                => comparing::open(app, path);
            CloseComparison(path: Option<PathBuf>): path.as_ref().map_or_else(|| "End the comparison".into(),
                    |p| format!("Close {}", p.display())), "Close what is shown beside this scene."
                => comparing::close(app, path.as_deref());
            ChooseImport: "Import as a scene\u{2026}",
                "Make a scene of the open result of another method: its objects can be named, edited, removed and asked."
                => import::choose_folder(app);
            Import(folder: PathBuf): format!("Import into {}", folder.display()),
                "Make a scene of the open result of another method." => import::run(app, folder);
            ChooseSheetFolder: "Save the comparison\u{2026}",
                "Write table, pictures and page of what all scenes answer to the phrase, in the nearest photo's view."
                => comparing::choose_sheet_folder(app);
            SaveSheet(folder: PathBuf): format!("Save the comparison into {}", folder.display()),
                "Write table, pictures and page of what all scenes answer to the phrase."
                => comparing::save_sheet(app, folder);
            ToggleDim: "Dim everything else", "Darken everything except answers and the selection.", "9"
                => app.layout.dim = !app.layout.dim;
            ToggleCameras: "Show or hide cameras", "Show the cameras of the nearest photos, while nothing is asked for, selected or in use.", "V"
                => app.layout.cameras = !app.layout.cameras;
            ToggleMeasurements: "Show or hide measurements", "Draw kept measurements into the view, also while nothing is measured."
                => app.layout.measurements = !app.layout.measurements;
            TogglePane(pane: Pane): format!("Show or hide the {} pane", pane.text().to_lowercase()),
                "Show or hide this pane." => app.layout.toggle(pane);
            FillWindow: "Fill the window with the view", "Show only the view, full screen; again to show everything.", "F11"
                => window::fill(app, ctx);
            ResetPanes: "Reset the panes", "Put every pane back in its initial place." => window::reset_panes(app);
            UseTheme(theme: ThemePreference): match theme {
                    ThemePreference::Dark => "Dark theme",
                    ThemePreference::Light => "Light theme",
                    ThemePreference::System => "System theme",
                }, "The view keeps its dark background." => window::use_theme(app, ctx, theme);
            LargerText: "Larger text", "Enlarge everything in the window." => egui::gui_zoom::zoom_in(ctx);
            SmallerText: "Smaller text", "Reduce everything in the window." => egui::gui_zoom::zoom_out(ctx);
            NormalText: "Normal text size", "Reset the size of everything in the window." => ctx.set_zoom_factor(1.0);
            ShowPane(pane: Pane): format!("Show the {} pane", pane.text().to_lowercase()), "Open this pane."
                => app.layout.show(pane);
            ChooseReport: "Open a report\u{2026}", "A report.json of fmlgs report: error vs. run time of every setting."
                => open::choose_report(app, false);
            ChooseSecondReport: "Compare with another report\u{2026}", "Shown with hollow markers, and side by side in the tables."
                => open::choose_report(app, true);
            OpenReport(path: PathBuf): format!("Open the report {}", path.display()), "Read this report."
                => open::report(app, path, false);
            CompareReport(path: PathBuf): format!("Compare with the report {}", path.display()), "Open it as the second report."
                => open::report(app, path, true);
            EndComparison: "Stop comparing reports", "Close the second report." => app.state.second_report = None;
            BenchmarkRendering: "Benchmark rendering",
                "Render a few views with many settings and compare them with the exact image. Takes minutes; can be canceled and resumed."
                => train::benchmark_rendering(app);
            ApplySetting(stage: StageName, knobs: Knobs): format!("Apply a setting of {}", stage.title().to_lowercase()),
                "Use this setting from now on." => train::apply_setting(app, stage, &knobs);
            ResetRenderSettings: "Reset render settings", "Render with the scene's own settings, not those taken from a report."
                => app.viewport.overrides = RenderOverrides::default();
            ToggleTimes: "Show or hide frame times",
                "How long each stage of a frame takes: the last, and the median of the last 60.", "F3"
                => app.layout.times = !app.layout.times;
            Palette: "Command palette", "Find and run any action by name.", "Ctrl+P" => app.palette.toggle();
            Shortcuts: "Keyboard shortcuts", "List every key and mouse gesture.", "F1" => app.sheet = !app.sheet;
            Guide: "Guide", "What each pane and tool does; works without a network." => app.help = Some(HelpPage::Guide);
            News: "What is new", "Changes of this version and of those before." => app.help = Some(HelpPage::News);
            About: "About FMLGS", "Version and license." => app.help = Some(HelpPage::About);
            Quit: "Quit", "Close the window. A running training keeps its last checkpoint.", "Ctrl+Q"
                => ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    };
}

pub(in crate::ui) use action_table;
