(** Trees for regions and for limits.

    A region is a union of parts, each a list of conditions by their numbers.  A condition
    has two polynomials in time: [kept] is not negative where it holds, [broken] is positive
    where it fails.  At a margin the two differ, and both speak of a whole ball.  Choices are
    lists of conditions: who keeps one of each is in some part. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing Halves Tree.
Import ListNotations.

(** ** The algorithm *)

Record condition := Condition { kept : list Z; broken : list Z }.
Record region := Region { parts : list (list nat); choices : list (list nat) }.

Inductive mark := Must | No | Out | Open.
Inductive status := Kept | Broken | Unclear.

Definition both (f : list Z -> list Z) (q : condition) : condition :=
  Condition (f (kept q)) (f (broken q)).

Definition known_of (q : condition) : status :=
  if all_positive (broken q) then Broken else if all_nonneg (kept q) then Kept else Unclear.

Definition is_kept (s : status) : bool := match s with Kept => true | _ => false end.
Definition is_broken (s : status) : bool := match s with Broken => true | _ => false end.

Definition all_kept (r : region) (st : nat -> status) : bool :=
  forallb (existsb (fun k => is_kept (st k))) (choices r).
Definition all_broken (r : region) (st : nat -> status) : bool :=
  forallb (existsb (fun k => is_broken (st k))) (parts r).

Definition statuses (c : list condition) (k : nat) : status :=
  match nth_error c k with Some q => known_of q | None => Unclear end.

(** What is not negative where a condition holds has falling coefficients. *)
Definition falls (c : list condition) (k : nat) : bool :=
  match nth_error c k with Some q => rising (rev (kept q)) | None => false end.

(** Of each part some condition is broken, or each one is kept or may only be left. *)
Definition leaves (r : region) (c : list condition) : bool :=
  let st := statuses c in
  forallb (fun p => existsb (fun k => is_broken (st k)) p
    || forallb (fun k => is_kept (st k) || falls c k) p) (parts r).

Definition holds (r : region) (m : mark) (c : list condition) : bool :=
  match m with
  | Must => all_kept r (statuses c)
  | No => all_broken r (statuses c)
  | Out => leaves r c
  | Open => true
  end.

Definition check_region (r : region) (c : list condition) (steps : list (step mark)) :
    option (list (leaf mark)) :=
  check_tree _ _ (map (both first_half)) (map (both second_half)) (holds r) c steps.

(** ** What the marks say *)

Open Scope R_scope.

Definition times : Type := R -> R.

Section Marks.
  Variable r : region.
  (** The two functions of time of each condition, by its number. *)
  Variable f : nat -> times * times.

  Definition known (a b : R) (c : list condition) : Prop :=
    forall k q, nth_error c k = Some q ->
      represents (kept q) (fst (f k)) a b /\ represents (broken q) (snd (f k)) a b.

  (** By the polynomials, time [x] is in the region, where the margin is zero. *)
  Definition inside (x : R) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> 0 <= fst (f k) x.

  (** A condition that is broken is not kept. *)
  Definition exact : Prop := forall k x, 0 < snd (f k) x -> fst (f k) x < 0.

  Definition says (m : mark) (a b : R) : Prop :=
    match m with
    | Open => True
    | Must => always (fun x => forall p, In p (choices r) -> exists k, In k p /\ 0 <= fst (f k) x) a b
    | No => always (fun x => forall p, In p (parts r) -> exists k, In k p /\ 0 < snd (f k) x) a b
    | Out => exact -> forall x y, a <= x -> x <= y -> y <= b -> inside y -> inside x
    end.

  Lemma known_cut : forall (h : list Z -> list Z) a b a' b' c,
    (forall l g, represents l g a b -> represents (h l) g a' b') ->
    known a b c -> known a' b' (map (both h) c).
  Proof.
    intros h a b a' b' c H K k q N; rewrite nth_error_map in N.
    destruct (nth_error c k) as [q0|] eqn:E; [|discriminate]; injection N as <-.
    destruct (K k q0 E); split; cbn; auto.
  Qed.

  Lemma known_sound : forall a b c k x, a < b -> known a b c -> a <= x <= b ->
    (statuses c k = Kept -> 0 <= fst (f k) x) /\ (statuses c k = Broken -> 0 < snd (f k) x).
  Proof.
    intros a b c k x Hab K Hx; unfold statuses, known_of.
    destruct (nth_error c k) as [q|] eqn:E; [|split; discriminate].
    destruct (K k q E) as [K1 K2]; split; destruct (all_positive (broken q)) eqn:P;
      try discriminate; destruct (all_nonneg (kept q)) eqn:N; try discriminate; intros _.
    - apply (all_nonneg_sound (kept q) (fst (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
  Qed.

  Lemma some_sound : forall (is : status -> bool) st (P : nat -> Prop) lists,
    (forall k, is (st k) = true -> P k) -> forallb (existsb (fun k => is (st k))) lists = true ->
    forall p, In p lists -> exists k, In k p /\ P k.
  Proof.
    intros is st P lists S H p Hp; rewrite forallb_forall in H.
    apply H, existsb_exists in Hp as (k & Hk & B); exists k; auto.
  Qed.

  (** Who is inside, and then outside, does not come back. *)
  Theorem leaves_once : forall a b c, a < b -> known a b c -> leaves r c = true -> exact ->
    forall x y, a <= x -> x <= y -> y <= b -> inside y -> inside x.
  Proof.
    intros a b c Hab K H E x y Hx Hxy Hy (p & Hp & I); exists p; split; auto; intros k Hk.
    unfold leaves in H; rewrite forallb_forall in H; specialize (H p Hp).
    apply orb_prop in H as [H|H].
    - apply existsb_exists in H as (j & Hj & B); specialize (I j Hj).
      destruct (known_sound a b c j y Hab K) as [_ S]; [lra|].
      assert (fst (f j) y < 0); [|lra].
      apply E, S; destruct (statuses c j); auto; discriminate.
    - rewrite forallb_forall in H; specialize (H k Hk); specialize (I k Hk).
      apply orb_prop in H as [H|H].
      + destruct (known_sound a b c k x Hab K) as [S _]; [lra|].
        apply S; destruct (statuses c k); auto; discriminate.
      + unfold falls in H; destruct (nth_error c k) as [q|] eqn:N; [|discriminate].
        destruct (K k q N) as [Kq _].
        pose proof (falls_sound _ _ a b x y Hab Kq H Hx Hxy Hy); lra.
  Qed.

  Lemma holds_sound : forall m a b c, a < b -> known a b c -> holds r m c = true -> says m a b.
  Proof.
    intros [| | |] a b c Hab K H; cbn in H |- *; auto.
    - intros x Hx; apply (some_sound is_kept (statuses c)); auto; intros k B.
      apply (known_sound a b c k x Hab K Hx); destruct (statuses c k); auto; discriminate.
    - intros x Hx; apply (some_sound is_broken (statuses c)); auto; intros k B.
      apply (known_sound a b c k x Hab K Hx); destruct (statuses c k); auto; discriminate.
    - apply (leaves_once a b c); auto.
  Qed.

  (** The leaves of a checked tree cover the interval, and their marks are true. *)
  Theorem check_region_sound : forall c steps leaves, known 0 1 c ->
    check_region r c steps = Some leaves -> tiles mark says 0 1 leaves.
  Proof.
    intros c steps leaves K H.
    apply (check_tree_sound _ _ (map (both first_half)) (map (both second_half)) (holds r) known says)
      with c steps; auto.
    - intros a b d; apply known_cut; intros; apply first_represents; auto.
    - intros a b d; apply known_cut; intros; apply second_represents; auto.
    - apply holds_sound.
  Qed.

  (** *** From polynomials to every point of the tube *)

  Variables (Point : Type) (tube : R -> Point -> Prop).
  (** Conditions as sets of points; what their polynomials say of the tube. *)
  Variable meets : nat -> Point -> Prop.
  Hypothesis about : forall k t q, tube t q ->
    (0 <= fst (f k) t -> meets k q) /\ (0 < snd (f k) t -> ~ meets k q).

  Definition in_region (q : Point) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> meets k q.

  Theorem no_tube : forall a b, says No a b ->
    forall t q, a <= t <= b -> tube t q -> ~ in_region q.
  Proof.
    intros a b S t q Ht Tq (p & Hp & I); destruct (S t Ht p Hp) as (k & Hk & P).
    destruct (about k t q Tq) as [_ N]; apply (N P), I; auto.
  Qed.

  Theorem must_tube : forall a b,
    (forall q, (forall p, In p (choices r) -> exists k, In k p /\ meets k q) -> in_region q) ->
    says Must a b -> forall t q, a <= t <= b -> tube t q -> in_region q.
  Proof.
    intros a b C S t q Ht Tq; apply C; intros p Hp; destruct (S t Ht p Hp) as (k & Hk & P).
    exists k; split; auto; apply (about k t q Tq); auto.
  Qed.
End Marks.

(** Who keeps one condition of each way to choose one of every part is in some part. *)
Theorem some_part : forall (C : Type) (keeps : C -> Prop) (parts : list (list C)),
  (forall k, keeps k \/ ~ keeps k) ->
  (forall choice, Forall2 (fun k p => In k p) choice parts -> exists k, In k choice /\ keeps k) ->
  exists p, In p parts /\ forall k, In k p -> keeps k.
Proof.
  intros C keeps parts Dec; induction parts as [|p parts IH]; intros H.
  - destruct (H [] (Forall2_nil _)) as (k & [] & _).
  - assert (W : (forall k, In k p -> keeps k) \/ exists k, In k p /\ ~ keeps k).
    { clear H IH; induction p as [|k p [A|(j & Hj & N)]]; [left; intros k [] | |].
      - destruct (Dec k); [left; intros j [<-|]; auto | right; exists k; split; [left|]; auto].
      - right; exists j; split; [right|]; auto. }
    destruct W as [A|(k & Hk & N)]; [exists p; split; [left|]; auto|].
    destruct IH as (p' & Hp & A); [|exists p'; split; [right|]; auto].
    intros choice F; destruct (H (k :: choice)) as (j & [<-|Hj] & P); [constructor; auto | contradiction|].
    exists j; auto.
Qed.

(** Where a sum of two functions, with weights above zero, is not above zero, one of them is not. *)
Theorem faces_meet : forall f g w, 0 < w -> f + w * g <= 0 -> f <= 0 \/ g <= 0.
Proof. intros f g w Hw H; destruct (Rle_lt_dec f 0); [left; auto | right; nra]. Qed.

(** ** Limits: one polynomial that is nowhere negative *)

Definition check_nonneg (l : list Z) (steps : list (step unit)) : bool :=
  match check_tree _ _ first_half second_half (fun _ => all_nonneg) l steps with
  | Some (_ :: _) => true
  | _ => false
  end.

Theorem check_nonneg_sound : forall l f steps, represents l f 0 1 ->
  check_nonneg l steps = true -> always (fun x => 0 <= f x) 0 1.
Proof.
  intros l f steps K H x Hx; unfold check_nonneg in H.
  destruct (check_tree _ _ _ _ _ _ _) as [[|p leaves]|] eqn:E; try discriminate.
  pose proof (check_tree_sound _ _ first_half second_half (fun _ : unit => all_nonneg)
    (fun a b c => represents c f a b) (fun _ a b => always (fun x => 0 <= f x) a b)) as T.
  specialize (T (fun a b c => first_represents c f a b) (fun a b c => second_represents c f a b)
    (fun _ a b c L R => all_nonneg_sound c f a b L R) _ _ _ K E).
  destruct (tiles_cover _ _ _ _ _ x T Hx) as (m & k & d & _ & B & S); [discriminate|].
  apply S; auto.
Qed.
